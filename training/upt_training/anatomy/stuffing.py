"""Stuffing by the command `upt mesh stuff` (crates/tissue, `tissue::stuffing`)."""

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file, save_file

from .distance import VOXEL


def command():
    """The `upt` command: `$UPT`, or the repository's own build, or the one on the path.

    Raises `FileNotFoundError` that says how to build it.
    """
    root = Path(__file__).resolve().parents[3]
    target = Path(os.environ.get("CARGO_TARGET_DIR", root / "target"))
    candidates = [os.environ.get("UPT"), target / "release" / "upt", shutil.which("upt")]
    for candidate in candidates:
        if candidate and Path(candidate).is_file():
            return str(candidate)
    raise FileNotFoundError(
        "the command `upt` fills the distance field and was not found; build it with "
        "`cargo build --release -p upt-cli`, or name it in the environment variable UPT"
    )


def stuff(grid, spacing, side):
    """Tetrahedra of the part of a distance `Grid` on one side of the plane x = 0.

    `side` is -1 for x < 0 and 1 for x > 0, `spacing` the lattice spacing in mm. Returns positions
    `[K, 3]` f64 (f32 values, x exactly 0 on the plane) and tetrahedra `[T, 4]` i64.
    """
    with tempfile.TemporaryDirectory() as folder:
        field = Path(folder) / "field.safetensors"
        mesh = Path(folder) / "half.mesh.safetensors"
        save_file(
            {"distance": np.ascontiguousarray(grid.values, dtype=np.float32)},
            field,
            metadata={
                "format": "upt-distance-field",
                "version": "1",
                "units": "mm",
                "origin": json.dumps([float(x) for x in grid.origin]),
                "voxel": repr(VOXEL),
            },
        )
        arguments = [command(), "mesh", "stuff", str(field), str(mesh)]
        arguments += ["--spacing", repr(float(spacing)), f"--half-space={side},0,0,0"]
        # The search for a count tries coarse lattices too.
        arguments += ["--least-share", "0.9"]
        done = subprocess.run(arguments, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(arguments)}: {done.stderr.strip()}")
        tensors = load_file(mesh)
    return tensors["positions"].astype(np.float64), tensors["tets"].astype(np.int64)
