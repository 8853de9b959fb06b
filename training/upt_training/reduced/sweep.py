"""Errors against the number of modes: one bundle each, from the same cases, modes and tables.

The modes are nested (those of a smaller model lead those of a larger one), so everything before the training is made
once for the largest count and cut for the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from upt_training.loads import WITHHELD
from upt_training.reduced.build import Options, Prepared, finish, prepare
from upt_training.reduced.evaluate import group_of
from upt_training.reduced.prior import Prior
from upt_training.reduced.states import States
from upt_training.reduced.statics import Statics
from upt_training.reduced.train import Settings

GROUPS = ("schemes_1_4", "scheme_5")


def leading_states(states: States, modes: int) -> States:
    """The same trajectories in the first `modes` residual modes."""
    return replace(states, b=states.b[:, :, :modes], p=states.p[:, :, :modes])


def leading_statics(statics: Statics | None, modes: int) -> Statics | None:
    """The same equilibria in the first `modes` residual modes."""
    return replace(statics, b=statics.b[:, :modes], p=statics.p[:, :modes]) if statics else None


def leading_prior(prior: Prior, modes: int) -> Prior:
    """The same tables with the first `modes` residual modes."""
    return replace(prior, residual=prior.residual[:modes], force_to_p=prior.force_to_p[:, :modes])


def floor(states: States, modes: int, group: str) -> float:
    """Mean squared error of the truth projected on `L(c)` and `modes` modes, mm², over the group's unseen cases."""
    schemes = np.array([group_of(str(scheme)) for scheme in states.scheme])
    unseen = (states.split == "test") | ((states.scheme == WITHHELD) & (states.split == "train"))
    part = states.pick(unseen & (schemes == group))
    outside = part.residual_square - (part.b[:, :, :modes].astype(np.float64) ** 2).sum(2)
    return float(np.maximum(outside, 0.0)[:, 2:][part.valid[:, 2:]].mean() / part.nodes) if part.cases else float("nan")


def sweep(
    options: Options,
    settings: Settings,
    description: str,
    counts: list[int],
    report: Callable[[str], None] = print,
) -> str:
    """Bundles `OUT-r` for every `r` of `counts`; returns their errors as a Markdown table."""
    made = prepare(replace(options, modes=max(counts)))
    results: list[tuple[str, dict, dict, Path | None]] = []
    for count in sorted(counts):
        name = f"{options.name}-{count}"
        own = replace(
            options, name=name, out=options.out.with_name(f"{options.out.name}-{count}"), work=options.work / str(count)
        )
        own.work.mkdir(exist_ok=True)
        cut: Prepared = replace(
            made,
            states=leading_states(made.states, count),
            statics=leading_statics(made.statics, count),
            prior=leading_prior(made.prior, count),
        )
        report(f"{count} modes")
        found = finish(own, settings, description, cut)
        if not results:
            results.append(("prior alone", found["prior"], {}, None))
        floors = {group: floor(made.states, count, group) for group in GROUPS}
        results.append((f"prior + correction, {count} modes", found["reduced"], floors, own.out))
    return rows(results)


def rows(results: list[tuple[str, dict, dict, Path | None]]) -> str:
    """Markdown: a line a model, schemes 1-4 and scheme 5 beside each other."""
    lines = [
        "| model | MSE, schemes 1-4, mm² | its floor | max error, mm | after release | MSE, scheme 5, mm² | its floor "
        "| max error, mm | bundle, MB |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, errors, floors, bundle in results:
        cells = [name]
        for group in GROUPS:
            e = errors.get(group)
            low = f"{floors[group]:.4f}" if group in floors and np.isfinite(floors[group]) else ""
            cells += [f"{e['mse_mm2']:.4f}", low, f"{e['max_mm']:.2f}"] if e else ["", "", ""]
            if group == GROUPS[0]:
                cells.append(f"{e['after_release_mse_mm2']:.4f}" if e and "after_release_mse_mm2" in e else "")
        size = sum(path.stat().st_size for path in bundle.iterdir()) / 1e6 if bundle else 0.0
        cells.append(f"{size:.1f}" if bundle else "")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
