"""Data is read memory-mapped: thirty times the data must not show in the largest resident set of `train`."""

import subprocess
import sys
from pathlib import Path

from conftest import CONFIGS

from upt_training.box_mesh import box_mesh

TABLES = Path(__file__).parents[1] / "tables"


def gigabytes(mesh: Path, cases: int) -> tuple[float, float]:
    """Of the displacements, and of the largest resident set."""
    made = ["--config", CONFIGS / "tiny-replay.toml", "--mesh", mesh, "--cases", str(cases), "--frames", "250"]
    command = [sys.executable, TABLES, "data_memory", *made, "--seconds", "0.5"]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    row = [cell.strip() for cell in run.stdout.splitlines()[-1].strip("|").split("|")]
    assert row[0] == "`tiny-replay`" and int(row[5]) > 0, run.stdout
    return float(row[3]), float(row[6])


def test_more_data_than_memory_growth(tmp_path):
    mesh = tmp_path / "box.mesh.safetensors"
    box_mesh(cells=(12, 12, 8)).save(mesh)
    small, base = gigabytes(mesh, 2)
    large, used = gigabytes(mesh, 60)
    assert large > small + 0.25
    assert used - base < 0.25 * (large - small), (base, used)
