"""Tables and plots of `ablate`, and their place in a page between `<!-- ablate SUITE: begin -->` and its end mark."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from upt_training.page import write_table

TEACHER = "teacher forcing"
PAPERS = "stochastic, window 5"  # the window that the paper's figure of accumulating errors shows


def marks(suite: str, label: str) -> str:
    """Name of the table in a page; images begin with the label too."""
    return f"ablate {suite} {label}".strip()


def table(results: dict) -> list[str]:
    """Markdown: a row a variant, then the reference scores."""
    timed = "minutes" in results.get("budget", {})
    head = ["samples", "minutes"] if timed else ["CPU s"]
    lines = [f"| variant | MSE, mm² | max error, mm | steps | {' | '.join(head)} |", "|---" * (4 + len(head)) + "|"]
    for name, r in results["variants"].items():
        spent = f"{r['samples']:,} | {r['minutes']:.1f}" if timed else f"{r['cpu_seconds']:.0f}"
        ended = ", cut short" if r.get("unfinished") else ""
        lines.append(f"| {name}{ended} | {r['mse_mm2']:.4f} | {r['max_mm']:.2f} | {r['steps']} | {spent} |")
    for name, value in results["references"].items():
        lines.append(f"| *{name}* | {value:.4f} |{' |' * (2 + len(head))}")
    return lines


def write_report(suite: str, results: dict, out: Path, page: Path | None, label: str = "") -> None:
    """`OUT/SUITE.json`, `OUT/SUITE.md`, plots in `OUT`; with `page`, also into it and into `images/` beside it.

    `label` tells two reports of one suite apart: it is part of the page's marks and of the images' names.
    """
    (out / f"{suite}.json").write_text(json.dumps(results, indent=1) + "\n")
    lines = table(results)
    (out / f"{suite}.md").write_text("\n".join(lines) + "\n")
    folders = [out] if page is None else [out, page.parent / "images"]
    plots = window_plots(results) if suite == "windows" else {"ablation": trick_plot(results)}
    for name, figure in plots.items():
        for folder in folders:
            figure.savefig(folder / f"{label}-{name}.png".removeprefix("-"), dpi=130)
    if page is not None:
        write_table(page, marks(suite, label), lines)


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def window_plots(results: dict) -> dict:
    """The paper's Fig. "window size" and Fig. "error accumulation"."""
    pyplot, runs = _pyplot(), results["variants"]
    names = [n for n in runs if n != TEACHER]
    sizes = [int(n.split()[-1]) for n in names]
    zero = results["references"].get("predict zero")
    size, axes = pyplot.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    for axis, key, label in zip(axes, ("mse_mm2", "max_mm"), ("MSE, mm²", "max error, mm"), strict=True):
        axis.plot(sizes, [runs[n][key] for n in names], "o-", color="C0", label="stochastic teacher forcing")
        if TEACHER in runs:
            axis.plot([2], [runs[TEACHER][key]], "s", color="C1", label="pure teacher forcing")
        top = 1.1 * max(r[key] for r in runs.values())
        if zero and key == "mse_mm2" and zero < top:
            axis.axhline(zero, color="0.5", lw=0.8, ls=":", label="predict zero")
        axis.set(xlabel="rollout window in training", ylabel=f"autoregressive {label}", xticks=sorted(sizes))
        axis.set_ylim(0, top)
    axes[0].legend(frameon=False, fontsize=8)
    growth, axis = pyplot.subplots(figsize=(6, 3.6), layout="constrained")
    shown = [PAPERS] if PAPERS in runs else sorted(names, key=lambda n: runs[n]["mse_mm2"])[:1]
    for name in [TEACHER] * (TEACHER in runs) + shown:
        r, colour = runs[name], "C1" if name == TEACHER else "C0"
        steps = np.arange(1, len(r["mse_per_step"]) + 1)
        label = f"{name}: MSE {r['mse_mm2']:.2f} mm², max error {r['max_mm']:.1f} mm"
        axis.plot(steps, r["mse_per_step"], color=colour, label=label)
        axis.fill_between(steps, r["mse_min"], r["mse_max"], color=colour, alpha=0.2, lw=0)
    axis.set(xlabel="step", ylabel="MSE, mm² (mean, lowest and highest case)")
    axis.set_ylim(bottom=0)
    axis.legend(frameon=False, fontsize=8, loc="upper left")
    return {"window-size": size, "error-accumulation": growth}


def trick_plot(results: dict):
    """A dot a variant."""
    pyplot, runs = _pyplot(), results["variants"]
    figure, axis = pyplot.subplots(figsize=(7, 0.3 * len(runs) + 1.2), layout="constrained")
    axis.plot([r["mse_mm2"] for r in runs.values()], list(runs), "o", color="C0")
    axis.grid(axis="y", lw=0.4)
    linear = results["references"].get("linear response, quasi-static")
    if linear:
        axis.axvline(linear, color="C3", ls="--", label="linear elasticity, quasi-static")
        axis.legend(frameon=False)
    axis.set(xlabel="autoregressive MSE, mm²", xscale="log")
    axis.invert_yaxis()
    return figure
