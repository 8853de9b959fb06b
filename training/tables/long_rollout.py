"""Ten cases in a row without a reset, 1,600 steps: does the error grow?

    python training/tables long_rollout BUNDLE --data DATA [--count 10]

MSE of each case inside the long rollout and of the same case from rest, and the
largest displacement of its last frame. Each case ends without contact, so the next one starts (nearly) at rest.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from upt_training.bundle_rollout import BundleRunner
from upt_training.dataset import Trajectory, open_dataset, open_trajectory

COLUMNS = [
    "steps",
    "case",
    "scheme",
    "MSE in a row, mm²",
    "MSE from rest, mm²",
    "largest displacement at the end, mm",
]
KEY = 2


def marks(options: argparse.Namespace) -> str:
    return f"long rollout {options.bundle.name}"


def roll(runner: BundleRunner, trajectory: Trajectory) -> tuple[float, float]:
    """Mean squared error over all frames but the first, mm², and the largest |u| at the end, mm."""
    errors = []
    for t in range(1, trajectory.frame_count):
        u = runner.step(*trajectory.contact(t))
        if t > 1:
            errors.append(((u - trajectory.displacement[t]) ** 2).sum(axis=1).mean())
    return float(np.mean(errors)), float(np.abs(u).max())


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--count", type=int, default=10)


def rows(options: argparse.Namespace) -> list[list[str]]:
    runner = BundleRunner(options.bundle)
    fresh = BundleRunner(options.bundle)
    found, step = [], 0
    for case in open_dataset(options.data, runner.mesh).select("test", count=options.count):
        trajectory = open_trajectory(case.path, runner.mesh)
        row, end = roll(runner, trajectory)
        fresh.reset()
        alone, _ = roll(fresh, trajectory)
        last = step + trajectory.frame_count - 1
        steps = f"{step + 1} to {last}"
        found.append([steps, str(case.index), case.scheme, f"{row:.4f}", f"{alone:.4f}", f"{end:.3f}"])
        print(*found[-1], sep=", ", file=sys.stderr, flush=True)
        step = last
    return found
