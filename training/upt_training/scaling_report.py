"""Table and plots of `scaling`, and their place in a page between `<!-- scaling: begin -->` and its end mark."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upt_training.errors import InputError
from upt_training.page import write_table

COLOURS = {"plain": "C1", "prior": "C0"}
LABELS = {"plain": "inputs u and c", "prior": "linear elasticity as base and input"}


@dataclass
class Reference:
    """A bundle's scores on all held-out cases, by `evaluate`, and on those that a training run scores."""

    name: str
    cases: list[dict]

    def mean(self, count: int, score: str = "mse_mm2") -> float:
        """Over `count` cases spread over the held-out ones, as `Trainer.evaluate` takes them."""
        at = np.unique(np.linspace(0, len(self.cases) - 1, min(count, len(self.cases))).round().astype(int))
        return float(np.mean([self.cases[i]["bundle"][score] for i in at]))


def read_reference(path: Path) -> Reference:
    """The JSON that `python -m upt_training evaluate BUNDLE --data DATA --out FILE` wrote for the same data."""
    if not path.exists():
        raise InputError(f"{path}: no such file; write it by `python -m upt_training evaluate BUNDLE --out {path}`")
    try:
        result = json.loads(path.read_text())
        return Reference(result["bundle"], sorted(result["cases"], key=lambda case: case["index"]))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not the JSON of `evaluate` ({error!r})") from error


def table(results: dict, bundle: Reference | None = None) -> list[str]:
    """A row for each inputs, size, number of cases and time; the spread is over the seeds."""
    groups: dict[tuple, list[dict]] = {}
    for r in results.values():
        key = (r["inputs"] != "plain", r["parameters"], r["training_cases"], r["core_minutes"])
        groups.setdefault(key, []).append(r)
    lines = [
        "| inputs | parameters | training cases | seeds | steps | samples | core-hours | training MSE, mm² | "
        "held-out MSE, mm² | max error, mm |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for _, group in sorted(groups.items()):
        ends, r = [r["curve"][-1] for r in group], group[0]

        def mean(name: str, ends=ends) -> str:
            values = [end[name] for end in ends]
            spread = f" ({min(values):.4f} to {max(values):.4f})" if len(values) > 1 else ""
            return f"{np.mean(values):.4f}{spread}"

        lines.append(
            f"| {r['inputs']} | {r['parameters']:,} | {r['training_cases']} | {len(group)} | {r['steps']:,} | "
            f"{r['samples']:,} | {np.mean([end['core_hours'] for end in ends]):.3f} | {mean('train_mse_mm2')} | "
            f"{mean('mse_mm2')} | {np.mean([end['max_mm'] for end in ends]):.2f} |"
        )
    references: dict[str, float] = {}
    for r in results.values():
        references |= r["references"]
    if bundle is not None:
        for count in sorted({r["curve"][-1]["cases"] for r in results.values()}):
            references[f"`{bundle.name}`, same {count} cases"] = bundle.mean(count)
        references[f"`{bundle.name}`, all {len(bundle.cases)} held-out cases"] = bundle.mean(len(bundle.cases))
    for name, value in references.items():
        lines.append(f"| *{name}* | | | | | | | | {value:.4f} | |")
    return lines


def write_report(results: dict, out: Path, page: Path | None, bundle: Reference | None = None) -> None:
    """`OUT/scaling.md` and plots in `OUT`; with `page`, also into it and into `images/` beside it."""
    lines = table(results, bundle)
    (out / "scaling.md").write_text("\n".join(lines) + "\n")
    figure = plot(results)
    for folder in [out] if page is None else [out, page.parent / "images"]:
        figure.savefig(folder / "scaling.png", dpi=130)
    if page is not None:
        write_table(page, "scaling", lines)


def plot(results: dict):
    """Error against parameters (the end of each run) and against core time (all points of each run)."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (by_size, by_time) = pyplot.subplots(1, 2, figsize=(9, 3.8), layout="constrained", sharey=True)
    marks = dict(zip(sorted({r["size"] for r in results.values()}, key=float), "osD^", strict=False))
    for inputs, colour in COLOURS.items():
        chosen = [r for r in results.values() if r["inputs"] == inputs]
        label = LABELS[inputs]
        for r in sorted(chosen, key=lambda r: r["parameters"]):
            mark = marks[r["size"]]
            by_size.plot(r["parameters"], r["curve"][-1]["mse_mm2"], mark, color=colour, label=label)
            minutes, errors = [60 * p["core_hours"] for p in r["curve"]], [p["mse_mm2"] for p in r["curve"]]
            by_time.plot(minutes, errors, mark + "-", color=colour, lw=0.8, markersize=4)
            label = None
    for size, mark in marks.items():
        by_time.plot([], [], mark, color="0.4", label=f"{size} M parameters")
    by_size.set(xscale="log", yscale="log", xlabel="parameters", ylabel="autoregressive MSE, mm²", xlim=(5e4, 6e6))
    by_time.set(yscale="log", xlabel="core-minutes of training")
    by_time.set_xlim(left=0.0)
    references = {name: value for r in results.values() for name, value in r["references"].items()}
    for style, name in ((":", "predict zero"), ("--", "linear elasticity, free vibration")):
        if name in references:
            for axis in (by_size, by_time):
                axis.axhline(references[name], color="0.5", lw=0.8, ls=style, label=name if axis is by_size else None)
    by_size.legend(frameon=False, fontsize=8)
    by_time.legend(frameon=False, fontsize=8)
    return figure
