"""Errors of a reduced bundle over full rollouts, on whole fields, as the paper defines them.

MSE: mean over nodes of the squared norm, mm², averaged over frames 2..F (the first step is excluded); max error: the
largest component over nodes, axes and those steps, mean and standard deviation over the cases; relative L2 beside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from upt_training.errors import InputError
from upt_training.loads import TOOL, TRAINED, WITHHELD
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.trajectories import Case


@dataclass
class CaseError:
    """One rollout: mean over its frames, and per frame."""

    scheme: str
    mse: float
    max_mm: float
    relative: float
    released_mse: float
    frames: np.ndarray


def released(case: Case, seconds: float = 1.0, dt_s: float = 0.05, least_push_mm: float = 2.0) -> np.ndarray:
    """Frames within `seconds` after an abrupt release."""
    touching, push = case.in_contact(), case.largest_push()
    out = np.zeros(case.frames, bool)
    for t in np.flatnonzero(touching[:-1] & ~touching[1:]):
        if push[t] >= least_push_mm:
            out[t + 1 : t + 1 + round(seconds / dt_s)] = True
    return out & ~touching


class Runner(Protocol):
    """What steps from contact to contact: the runners of both kinds of bundle."""

    def reset(self) -> None: ...

    def step(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray: ...


def roll_case(runner: Runner, case: Case) -> CaseError:
    """Autoregressive rollout of one trajectory from rest."""
    runner.reset()
    mse, largest, truth = np.zeros(case.frames), np.zeros(case.frames), np.zeros(case.frames)
    for t in range(1, case.frames):
        rows = slice(case.offsets[t], case.offsets[t + 1])
        found = runner.step(case.nodes[rows], case.vectors[rows])
        true = np.asarray(case.displacement[t], np.float32)
        error = found - true
        mse[t] = float((error.astype(np.float64) ** 2).sum(1).mean())
        truth[t] = float((true.astype(np.float64) ** 2).sum(1).mean())
        largest[t] = float(np.abs(error).max())
    mask = released(case)
    return CaseError(
        case.scheme,
        float(mse[2:].mean()),
        float(largest[2:].max()),
        float(np.sqrt(mse[2:].sum() / max(truth[2:].sum(), 1e-12))),
        float(mse[mask].mean()) if mask.any() else float("nan"),
        mse,
    )


def zero_error(case: Case) -> CaseError:
    """Predicting no displacement."""
    mse, largest = np.zeros(case.frames), np.zeros(case.frames)
    for t in range(1, case.frames):
        true = np.asarray(case.displacement[t], np.float64)
        mse[t], largest[t] = (true**2).sum(1).mean(), np.abs(true).max()
    mask = released(case)
    after = float(mse[mask].mean()) if mask.any() else float("nan")
    return CaseError(case.scheme, float(mse[2:].mean()), float(largest[2:].max()), 1.0, after, mse)


def group_of(scheme: str) -> str:
    """`schemes_1_4`, `scheme_5`, `tools`, or `hard`."""
    if scheme in TRAINED:
        return "schemes_1_4"
    if scheme.startswith(TOOL):
        return "tools"
    return "scheme_5" if scheme == WITHHELD else "hard"


def summarise(errors: list[CaseError]) -> dict[str, dict]:
    """Mean and standard deviation over the cases of each group, and of each hard regime by itself."""
    out = {}
    regimes = sorted({e.scheme for e in errors if group_of(e.scheme) == "hard"})
    for group in ("schemes_1_4", "scheme_5", "tools", "hard", *regimes):
        of = [e for e in errors if group in (group_of(e.scheme), e.scheme)]
        if not of:
            continue
        mse, largest = np.array([e.mse for e in of]), np.array([e.max_mm for e in of])
        after = np.array([e.released_mse for e in of])
        out[group] = {
            "cases": len(of),
            "mse_mm2": float(mse.mean()),
            "mse_std": float(mse.std()),
            "max_mm": float(largest.mean()),
            "max_std": float(largest.std()),
            "relative_l2": float(np.mean([e.relative for e in of])),
        }
        if np.isfinite(after).any():
            out[group]["after_release_mse_mm2"] = float(np.nanmean(after))
    return out


def evaluate(
    folder: Path, cases: list[Case], progress: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, dict]:
    """Errors of the bundle, of its prior alone and of predicting zero, by group of schemes."""
    runner = ReducedRunner(folder)
    rows: dict[str, list[CaseError]] = {"zero": [], "prior": [], "reduced": []}
    for index, case in enumerate(cases):
        rows["zero"].append(zero_error(case))
        runner.correct = False
        rows["prior"].append(roll_case(runner, case))
        runner.correct = True
        rows["reduced"].append(roll_case(runner, case))
        progress(index + 1, len(cases))
    return {name: summarise(errors) for name, errors in rows.items()}


def insert_table(page: Path, name: str, text: str) -> None:
    """Replace what stands between `<!-- table NAME -->` and `<!-- end NAME -->` of a page."""
    start, end = f"<!-- table {name} -->", f"<!-- end {name} -->"
    content = page.read_text(encoding="utf-8")
    if start not in content or end not in content:
        raise InputError(f"{page}: the markers {start} and {end} are missing")
    before, rest = content.split(start, 1)
    page.write_text(f"{before}{start}\n{text}\n{end}{rest.split(end, 1)[1]}", encoding="utf-8")


def table(result: dict[str, dict]) -> str:
    """The result as a Markdown table."""
    head = "| method | cases | MSE, mm² | max error, mm | relative L2 | MSE in the second after release |"
    lines = [head, "|---|---|---|---|---|---|"]
    for method, groups in result.items():
        for group, e in groups.items():
            after = f"{e['after_release_mse_mm2']:.4f}" if "after_release_mse_mm2" in e else ""
            lines.append(
                f"| {method}, {group.replace('_', ' ')} | {e['cases']} | {e['mse_mm2']:.5f} ± {e['mse_std']:.5f} "
                f"| {e['max_mm']:.2f} ± {e['max_std']:.2f} | {e['relative_l2']:.4f} | {after} |"
            )
    return "\n".join(lines)
