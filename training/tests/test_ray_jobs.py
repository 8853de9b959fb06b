"""`upt make --emit ray` on a real Ray with two workers: a small organ, four trajectories in two shards."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
UPT = ROOT / "target" / "release" / ("upt.exe" if os.name == "nt" else "upt")
RAY = "ray==2.51.1"


def python_with_ray() -> Path:
    """An interpreter of its own under target/, as Ray needs many packages that nothing else does."""
    folder = ROOT / "target" / "ray"
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    if subprocess.run([python, "-c", "import ray"], capture_output=True).returncode != 0:
        command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", RAY]
        installed = subprocess.run(command, capture_output=True, text=True)
        if installed.returncode != 0:
            last = (installed.stderr.strip().splitlines() or ["no message"])[-1]
            pytest.skip(f"{RAY} cannot be installed: {last}")
    return python


def egg(path: Path) -> None:
    """A closed ellipsoid with half axes 50, 40 and 30 mm."""
    rings, sectors = 9, 16
    lines = ["v 0 0 30"]
    for ring in range(1, rings):
        for sector in range(sectors):
            theta, phi = np.pi * ring / rings, 2 * np.pi * sector / sectors
            point = [50 * np.sin(theta) * np.cos(phi), 40 * np.sin(theta) * np.sin(phi), 30 * np.cos(theta)]
            lines.append("v " + " ".join(f"{x:.5f}" for x in point))
    lines.append("v 0 0 -30")
    last = 2 + (rings - 1) * sectors

    def at(ring: int, sector: int) -> int:
        return 2 + (ring - 1) * sectors + sector % sectors

    for s in range(sectors):
        lines += [f"f 1 {at(1, s)} {at(1, s + 1)}", f"f {last} {at(rings - 1, s + 1)} {at(rings - 1, s)}"]
        for r in range(1, rings - 1):
            lines.append(f"f {at(r, s)} {at(r + 1, s)} {at(r + 1, s + 1)}")
            lines.append(f"f {at(r, s)} {at(r + 1, s + 1)} {at(r, s + 1)}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_two_workers_make_a_bundle_and_its_trajectories(tmp_path: Path) -> None:
    if os.environ.get("UPT_NIGHTLY") != "1":
        pytest.skip("skipped: nightly, an environment with Ray and a bundle made in it take minutes")
    if not UPT.exists():
        pytest.skip(f"{UPT} is not built: cargo build --release -p upt-cli")
    python = python_with_ray()
    egg(tmp_path / "organ.obj")
    make = [str(UPT), "make", "organ.obj", "--out", "organ", "--fixed", "plane:0,0,-1,-20", "--nodes", "350"]
    make += ["--natural", "24", "--patches", "24", "--cases", "1", "--minutes", "1", "--emit", "ray", "jobs"]
    subprocess.run(make, cwd=tmp_path, check=True)
    environment = dict(os.environ, PATH=f"{UPT.parent}{os.pathsep}{os.environ['PATH']}", RAY_DEDUP_LOGS="0")
    job = [str(python), "jobs/run.py", "--cores", "1", "--shards", "2", "--cases", "4", "--stages", "make", "data"]
    ran = subprocess.run(job, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "2 workers simulated 2 shards" in ran.stdout
    certificate = json.loads((tmp_path / "organ" / "certificate.json").read_text(encoding="utf-8"))
    assert certificate["contact"]["share_of_linear"] < 0.5
    assert len(list((tmp_path / "organ.work" / "data").rglob("*.trajectory.safetensors"))) == 4
