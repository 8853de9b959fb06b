"""What training runs got and reached: `python training/tables runs RUN[=JSON] ... --evaluation JSON`.

Reads the last scores in `log.csv` and the steps and CPU time in `last.pt` of each run folder; a run that has not been
scored yet has no error in the table. `RUN=JSON` takes the scores that `evaluate` gave its bundle. `--evaluation` is
the JSON of `evaluate` of a bundle on the same data, to compare with on the same cases. Bars and goals are of all
held-out cases: scores of a few of them can miss, not reach them.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

from upt_training.config import settings_from_dict
from upt_training.model import Upt
from upt_training.scaling_report import Reference, read_reference
from upt_training.trainer import load_checkpoint

PLAIN = (0.4, 0.09)
BARS = {
    "paper": PLAIN,
    "paper-replay": PLAIN,
    "paper-gpu": (0.2, 0.09),
    "paper-recipe-gpu": (0.2, 0.09),
    "paper-fine": (0.2, 0.09),
    "plain-replay": PLAIN,
    "paper-prior": (0.013, 0.006),
    "paper-prior-fine": (0.025, 0.01),
}
MARKS, KEY = "paper runs", 1


def verdict(mse: float | None, limit: float, cases: int, every: int) -> str:
    """Whether a bar or goal is reached, as far as the scored cases say."""
    if mse is None or mse > limit:
        return f"{limit} not reached"
    return f"{limit} reached" if cases >= every else f"{limit} open: {cases} of {every} cases"


def row(named: str, bundle: Reference) -> list[str]:
    folder, _, scores = named.partition("=")
    run = Path(folder)
    checkpoint = load_checkpoint(run / "last.pt")
    settings = settings_from_dict(checkpoint["settings"], str(run))
    t, scored = settings.train, None
    if (run / "log.csv").exists():
        with (run / "log.csv").open() as file:
            scored = list(csv.DictReader(file))[-1]
    cases, mse, largest = t.evaluate_cases, None, None
    if scores:
        own = read_reference(Path(scores))
        cases = len(own.cases)
        mse, largest = own.mean(cases), own.mean(cases, "max_mm")
    elif scored is not None:
        mse, largest = float(scored["test_mse_mm2"]), float(scored["test_max_mm"])
    after = "" if scored is None else f", after step {int(scored['step']):,}"
    epochs = t.epochs + t.autoregressive_epochs
    steps = f"{t.steps_per_epoch * epochs:,}" if t.steps_per_epoch else f"{epochs} epochs"
    cells = [
        f"`{settings.name}`",
        f"{Upt(settings.model).parameter_count():,}",
        f"{checkpoint['step_count']:,}",
        steps,
        f"{checkpoint['step_count'] * t.samples_per_step:,}",
        f"{checkpoint['core_seconds'] / 3600:.2f}",
        "not scored" if mse is None else f"{mse:.4f} ({cases}{after})",
        "-" if largest is None else f"{largest:.2f}",
    ]
    cells.append(f"{bundle.mean(cases):.4f}")
    every = len(bundle.cases)
    cells += [verdict(mse, limit, cases, every) for limit in BARS.get(settings.name, ())]
    return cells + ["-"] * (11 - len(cells))


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run", nargs="+", help="run folders, each with `=JSON` of `evaluate` of its bundle")
    parser.add_argument("--evaluation", type=Path, required=True, help="JSON of `evaluate` of a bundle")


def columns(options: argparse.Namespace) -> list[str]:
    return [
        "configuration",
        "parameters",
        "steps done",
        "of",
        "samples",
        "core-hours",
        "held-out MSE, mm² (cases)",
        "max error, mm",
        f"`{read_reference(options.evaluation).name}`, same cases",
        "bar",
        "goal",
    ]


def rows(options: argparse.Namespace) -> list[list[str]]:
    bundle = read_reference(options.evaluation)
    return [row(run, bundle) for run in options.run]
