"""libupt through its Python package, and its reference solver (the truth) through the command `upt`. One thread."""

from __future__ import annotations

import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import upt
from case import Case, Run


def run(bundle: Path, case: Case, setting: dict, frames: int) -> Run:
    began = time.perf_counter()
    options = {} if setting["corrections"] == "recommended" else {"corrections": setting["corrections"]}
    scene = upt.Model(str(bundle)).scene(threads=1, **options)
    set_up = time.perf_counter() - began
    u, force = [np.zeros(case.positions.shape)], [np.zeros((len(case.tools), 3))]
    processor, wall = [0.0], [0.0]
    for frame in range(1, frames):
        instruments = [
            upt.Instrument.capsule(
                half_length=t.half_length,
                radius=t.radius,
                position=t.poses[frame, :3],
                rotation=t.poses[frame, 3:],
                friction=t.friction,
            )
            for t in case.tools
        ]
        a, b = time.process_time(), time.perf_counter()
        moved = scene.step(instruments=instruments)
        processor.append(time.process_time() - a)
        wall.append(time.perf_counter() - b)
        u.append(np.array(moved, dtype=float))
        force.append(np.array([reading.force for reading in scene.readings()]))
    return Run(
        np.array(u, np.float32),
        np.array(force),
        np.array(processor),
        np.array(wall),
        set_up,
        versions={"libupt": upt.__version__},
    )


def reference(command: Path, mesh: Path, case: Case, programme: str, seed: int) -> Run:
    """The same case simulated anew: its time only, spread evenly over the frames."""
    with tempfile.TemporaryDirectory() as folder:
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run(
            [
                command,
                "simulate",
                "--mesh",
                mesh,
                "--tool",
                programme,
                "--seed",
                str(seed),
                "--threads",
                "1",
                "--out",
                os.path.join(folder, "case.trajectory.safetensors"),
            ],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    ones = np.ones(case.frames)
    return Run(case.truth, case.force, used / case.frames * ones, wall / case.frames * ones, 0.0)
