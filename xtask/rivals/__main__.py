"""What a developer would pick instead, on the same mesh and poses: `cargo xtask rivals` (docs/results/accuracy.md).

Every run stands between two runs of libupt with three corrections, and its time is a ratio to them. A row is written
to OUT/rows.jsonl as soon as it is measured, and rows that are there are not measured again, so an interrupted study
goes on. A peer that is not installed, or that fails, is a row with the reason.
"""

from __future__ import annotations

import argparse
import importlib
import json
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import outside
import report
from case import Case, Run, load, scores

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
MESHES = {"coarse": ("brain-coarse", "brain-coarse-reduced"), "fine": ("brain", "brain-reduced")}
# Programme and seed of `upt simulate --tool`: seeds whose tools are capsules.
CASES = {
    "press": ("coarse", "press", 3),
    "stroke": ("coarse", "stroke", 3),
    "deep": ("coarse", "press", 2),
    "poke": ("coarse", "poke", 3),
    "two": ("coarse", "two", 3),
    "fine-press": ("fine", "press", 3),
}
BESIDE = {"corrections": 3}
# Method, what its row says, its setting, and the most frames on each mesh (0: not run there).
METHODS = [
    ("libupt", "k = 0", {"corrections": -1}, (999, 999)),
    ("libupt", "k = 2", {"corrections": 2}, (999, 999)),
    ("libupt", "k = 3", {"corrections": 3}, (999, 999)),
    ("libupt", "as recommended", {"corrections": "recommended"}, (999, 999)),
    ("reference solver", "0.1 ms", {}, (999, 999)),
    ("Jolt", "60 Hz x 5 (its default)", {"steps": 3, "iterations": 5}, (999, 999)),
    ("Jolt", "60 Hz x 20", {"steps": 3, "iterations": 20}, (999, 30)),
    ("Jolt", "60 Hz x 20, vertices 1 mm thick", {"steps": 3, "iterations": 20, "vertex_radius_mm": 1.0}, (999, 0)),
    (
        "rapier",
        "constraints, 60 Hz x 4 (its default)",
        {"steps": 3, "iterations": 4, "solver": "constraints"},
        (999, 20),
    ),
    ("rapier", "constraints, 60 Hz x 16", {"steps": 3, "iterations": 16, "solver": "constraints"}, (40, 0)),
    ("rapier", "fem, 20 Hz x 1", {"steps": 1, "iterations": 1, "solver": "fem"}, (999, 20)),
    ("rapier", "fem, 60 Hz x 1", {"steps": 3, "iterations": 1, "solver": "fem"}, (999, 0)),
    ("rapier", "fem, 60 Hz x 4", {"steps": 3, "iterations": 4, "solver": "fem"}, (40, 0)),
    ("MuJoCo flex", "50 ms", {"step_s": 0.05}, (999, 0)),
    ("MuJoCo flex", "25 ms", {"step_s": 0.025}, (999, 0)),
    ("MuJoCo flex", "25 ms, stiff contact", {"step_s": 0.025, "contact": "hard"}, (999, 0)),
    ("MuJoCo flex", "10 ms, stiff contact", {"step_s": 0.01, "contact": "hard"}, (999, 0)),
    ("Newton VBD", "5 substeps x 5", {"substeps": 5, "iterations": 5}, (999, 0)),
    ("Newton VBD", "10 x 10 (near its examples)", {"substeps": 10, "iterations": 10}, (40, 0)),
    ("Newton VBD", "10 x 30", {"substeps": 10, "iterations": 30}, (30, 0)),
    ("Bullet FEM", "0.2 ms", {"step_s": 0.0002}, (12, 0)),
]


def runner(method: str, options, mesh: str, case: Case, programme: str, seed: int):
    """A function of setting and frames."""
    if method == "libupt":
        ours = importlib.import_module("ours")
        return lambda setting, frames: ours.run(ROOT / "onnx" / MESHES[mesh][1], case, setting, frames)
    if method == "reference solver":
        ours = importlib.import_module("ours")
        path = ROOT / "onnx" / "meshes" / f"{MESHES[mesh][0]}.mesh.safetensors"
        return lambda setting, frames: ours.reference(options.upt, path, case, programme, seed)
    if method == "Jolt":
        return lambda setting, frames: outside.run(
            ["node", str(HERE / "jolt.mjs"), str(options.jolt)], case, setting, frames
        )
    if method == "rapier":
        return lambda setting, frames: outside.run([str(options.rapier)], case, setting, frames)
    module = {"MuJoCo flex": "mujoco_flex", "Newton VBD": "newton_vbd", "Bullet FEM": "bullet"}[method]
    peer = importlib.import_module(module)
    return lambda setting, frames: peer.run(case, setting, frames)


def milliseconds(run: Run, case: Case) -> dict[str, float]:
    """Of the frames in which the truth's tissue pushes a tool: a frame without contact costs some methods nothing."""
    touched = np.linalg.norm(case.force[1 : len(run.processor)], axis=2).max(axis=1) > 0
    ms = 1e3 * run.processor[1:][touched]
    return {
        "ms": float(np.median(ms)),
        "ms_p99": float(np.percentile(ms, 99)),
        "wall_ms": float(np.median(1e3 * run.wall[1:][touched])),
        "set_up_s": run.set_up_s,
    }


def measured(method: str, label: str, setting: dict, case: Case, frames: int, run, beside) -> dict:
    """A row: scores and times, and those of libupt with three corrections over the same frames, before and after."""
    row = {"case": case.name, "method": method, "setting": label}
    try:
        before = beside(BESIDE, frames)
        found = run(setting, frames)
        after = beside(BESIDE, frames)
    except Exception as error:  # a peer that fails leaves the other rows
        return row | {"why": f"{type(error).__name__}: {error}".splitlines()[0][:200]}
    own = 0.5 * (milliseconds(before, case)["ms"] + milliseconds(after, case)["ms"])
    row |= scores(case, found) | milliseconds(found, case) | {"versions": found.versions, "beside_ms": own}
    return row | {"ratio": row["ms"] / own, "beside_mse_mm2": scores(case, before)["mse_mm2"]}


def main() -> None:
    parser = argparse.ArgumentParser(prog="cargo xtask rivals --", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--upt", type=Path, required=True, help="the command upt")
    parser.add_argument("--jolt", type=Path, help="unpacked npm package jolt-physics")
    parser.add_argument("--rapier", type=Path, help="the programme of xtask/rivals/rapier")
    parser.add_argument("--cases", nargs="*", default=list(CASES))
    parser.add_argument("--only", nargs="*", help="methods")
    parser.add_argument("--page", type=Path, help="write tables and chart there")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "rows.jsonl"
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {(row["case"], row["method"], row["setting"]) for row in rows if "why" not in row}
    for name in options.cases:
        mesh, programme, seed = CASES[name]
        file = options.out / f"{name}.trajectory.safetensors"
        mesh_path = ROOT / "onnx" / "meshes" / f"{MESHES[mesh][0]}.mesh.safetensors"
        if not file.exists():
            subprocess.run(
                [options.upt, "simulate", "--mesh", mesh_path, "--tool", programme, "--seed", str(seed), "--out", file],
                check=True,
                stdout=subprocess.DEVNULL,
            )
        case = load(file, mesh_path)
        for method, label, setting, most in METHODS:
            frames = min(case.frames, most[mesh == "fine"])
            if frames == 0 or (name, method, label) in done or (options.only and method not in options.only):
                continue
            try:
                run = runner(method, options, mesh, case, programme, seed)
                beside = runner("libupt", options, mesh, case, programme, seed)
                row = measured(method, label, setting, case, frames, run, beside)
            except ImportError as error:
                row = {"case": name, "method": method, "setting": label, "why": str(error)}
            rows = [r for r in rows if (r["case"], r["method"], r["setting"]) != (name, method, label)] + [row]
            path.write_text("".join(json.dumps(r) + "\n" for r in rows))
            said = row.get("why") or f"MSE {row['mse_mm2']} mm2, {row['ms']:.2f} ms, {row['ratio']:.1f} times libupt"
            print(f"{name}, {method}, {label}: {said}", file=sys.stderr)
    if options.page:
        report.write(rows, options.page, platform.processor() or platform.machine())


if __name__ == "__main__":
    main()
