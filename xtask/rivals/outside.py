"""Peers that are programmes of their own: a folder with the case goes in, displacements and times come out.

`case.json` holds frames, frame_s, tools, setting and material (SI); `positions.f32 [K,3]`, `masses.f32 [K]`,
`tets.u32 [T,4]`, `surface.u32 [S,3]`, `held.u32` and `poses.f32 [F,n,7]` lie beside it (m, kg). The programme writes
`out.f32 [F,K,3]` (m) and `out.json`.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from case import DAMPING, DENSITY, FRAME_S, POISSON, YOUNG_PA, Case, Run


def run(command: list[str], case: Case, setting: dict, frames: int) -> Run:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        poses = np.stack([tool.poses for tool in case.tools], axis=1)[:frames].copy()
        poses[:, :, :3] *= 1e-3
        tools = [
            {"radius": 1e-3 * t.radius, "half_length": 1e-3 * t.half_length, "friction": t.friction} for t in case.tools
        ]
        about = {
            "frames": frames,
            "frame_s": FRAME_S,
            "tools": tools,
            "setting": setting,
            "young_pa": YOUNG_PA,
            "poisson": POISSON,
            "density": DENSITY,
            "damping": DAMPING,
        }
        (folder / "case.json").write_text(json.dumps(about))
        for file, array in (
            ("positions.f32", 1e-3 * case.positions),
            ("masses.f32", case.masses()),
            ("tets.u32", case.tets),
            ("surface.u32", case.surface),
            ("held.u32", case.held),
            ("poses.f32", poses),
        ):
            array.astype("<f4" if file.endswith("f32") else "<u4").tofile(folder / file)
        subprocess.run([*command, str(folder)], check=True)
        out = json.loads((folder / "out.json").read_text())
        u = 1e3 * np.fromfile(folder / "out.f32", "<f4").reshape(-1, len(case.positions), 3)
    return Run(u, None, np.array(out["processor"]), np.array(out["wall"]), out["set_up_s"], versions=out["versions"])
