"""What training runs got and reached: `run_table.py RUN [RUN ...] --page docs/training.md`.

Reads the last scores in `log.csv` and the steps and CPU time in `last.pt` of each run folder; a run that has not been
scored yet has no error in the table. Bars and goals are those of the paper's network, MSE in mm² on schemes 1-4.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from upt_training.config import settings_from_dict  # noqa: E402
from upt_training.model import Upt  # noqa: E402
from upt_training.page import write_table  # noqa: E402
from upt_training.trainer import load_checkpoint  # noqa: E402

BARS = {"paper": (0.4, 0.09), "paper-prior": (0.013, 0.006)}
HEAD = (
    "| configuration | parameters | steps done | of | samples | core-hours | held-out MSE, mm² (cases) | "
    "max error, mm | bar | goal |"
)


def row(run: Path) -> str:
    checkpoint = load_checkpoint(run / "last.pt")
    settings = settings_from_dict(checkpoint["settings"], str(run))
    t, scored = settings.train, None
    if (run / "log.csv").exists():
        with (run / "log.csv").open() as file:
            scored = list(csv.DictReader(file))[-1]
    mse = None if scored is None else float(scored["test_mse_mm2"])
    epochs = t.epochs + t.autoregressive_epochs
    steps = f"{t.steps_per_epoch * epochs:,}" if t.steps_per_epoch else f"{epochs} epochs"
    cells = [
        f"`{settings.name}`",
        f"{Upt(settings.model).parameter_count():,}",
        f"{checkpoint['step_count']:,}",
        steps,
        f"{checkpoint['step_count'] * t.samples_per_step:,}",
        f"{checkpoint['core_seconds'] / 3600:.2f}",
        "not scored" if mse is None else f"{mse:.4f} ({t.evaluate_cases}, after step {int(scored['step']):,})",
        "-" if scored is None else f"{float(scored['test_max_mm']):.2f}",
    ]
    for limit in BARS.get(settings.name, ()):
        cells.append(f"{limit} {'reached' if mse is not None and mse <= limit else 'not reached'}")
    return "| " + " | ".join(cells + ["-"] * (10 - len(cells))) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, nargs="+", help="run folders")
    parser.add_argument("--page", type=Path, help="page to write into, between the marks `paper runs`")
    options = parser.parse_args()
    lines = [HEAD, "|---" * 10 + "|", *(row(run) for run in options.run)]
    print("\n".join(lines))
    if options.page:
        write_table(options.page, "paper runs", lines)


if __name__ == "__main__":
    main()
