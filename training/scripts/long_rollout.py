"""Ten cases in a row without a reset, 1,600 steps: does the error grow?

    python training/scripts/long_rollout.py BUNDLE --data DATA [--count 10] [--page PAGE]

Prints or writes a Markdown table: MSE of each case inside the long rollout and of the same case from rest, and the
largest displacement of its last frame. Each case ends without contact, so the next one starts (nearly) at rest.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from upt_training.bundle_rollout import BundleRunner  # noqa: E402
from upt_training.dataset import Trajectory, open_dataset, open_trajectory  # noqa: E402
from upt_training.page import write_table  # noqa: E402


def roll(runner: BundleRunner, trajectory: Trajectory) -> tuple[float, float]:
    """Mean squared error over all frames but the first, mm², and the largest |u| at the end, mm."""
    errors = []
    for t in range(1, trajectory.frame_count):
        u = runner.step(*trajectory.contact(t))
        if t > 1:
            errors.append(((u - trajectory.displacement[t]) ** 2).sum(axis=1).mean())
    return float(np.mean(errors)), float(np.abs(u).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--page", type=Path, help="page whose table `long rollout NAME` to exchange")
    options = parser.parse_args()
    runner = BundleRunner(options.bundle)
    fresh = BundleRunner(options.bundle)
    cases = open_dataset(options.data, runner.mesh).select("test", count=options.count)
    lines = [
        "| steps | case | scheme | MSE in a row, mm² | MSE from rest, mm² | largest displacement at the end, mm |",
        "|---|---|---|---|---|---|",
    ]
    step = 0
    for case in cases:
        trajectory = open_trajectory(case.path, runner.mesh)
        row, end = roll(runner, trajectory)
        fresh.reset()
        alone, _ = roll(fresh, trajectory)
        last = step + trajectory.frame_count - 1
        lines.append(f"| {step + 1} to {last} | {case.index} | {case.scheme} | {row:.4f} | {alone:.4f} | {end:.3f} |")
        print(lines[-1], file=sys.stderr, flush=True)
        step = last
    if options.page:
        write_table(options.page, f"long rollout {options.bundle.name}", lines)
    else:
        print("\n".join(lines))


if __name__ == "__main__":
    main()
