"""Results of `evaluate`: `python training/tables evaluation A.json ... [--overall] [--paper]`.

`NAME=A.json` names the bundle. `--paper` leaves the plain methods out and puts the paper's own figures beside the
bundle's: its 40 cases of schemes 1-4, its 10 of scheme 5, its 10 on the fine mesh.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

COLUMNS = ["cases (number)", "method", "MSE, mm²", "range", "Hausdorff, mm", "max error, mm", "relative L2"]
MARKS, KEY = "evaluation", 2
NAMES = {
    "bundle": "",
    "coarse_fem": "coarse FEM, embedded",
    "linear": "linear elasticity",
    "linear_decay": "linear elasticity, decay",
    "linear_vibration": "linear elasticity, free vibration",
    "zero": "predict zero",
}
# Greifeneder et al., arXiv 2601.13676, section "Results": mean ± standard deviation and, where given, the range.
PAPER = {
    ("schemes 1-4", 21_679): ("40", "0.09 ± 0.07", "0.02 to 0.31", "1.81 ± 0.52", "2.37 ± 0.77"),
    ("scheme 5", 21_679): ("10", "0.09 ± 0.04", "-", "1.99 ± 0.27", "1.94 ± 0.53"),
    ("scheme 1", 151_201): ("10", "0.09 ± 0.04", "-", "2.03 ± 0.30", "3.63 ± 0.51"),
}


def paper_rows() -> list[list[str]]:
    """What the paper reports; it has no relative error."""
    return [
        [f"{group}, K = {nodes} ({count})", "*the paper*", *scores, "-"]
        for (group, nodes), (count, *scores) in PAPER.items()
    ]


def rows_of_result(named: str, only_bundle: bool = False, overall: bool = False) -> list[list[str]]:
    name, _, path = named.rpartition("=")
    result = json.loads(Path(path).read_text())
    bundle = name or result["bundle"]
    groups = {f"scheme {k}": v for k, v in result["schemes"].items()}
    if len(groups) > 1:
        every = {"schemes " + "-".join((min(result["schemes"]), max(result["schemes"]))): result["all"]}
        groups = every if overall else every | groups
    out = []
    for group, table in groups.items():
        count = sum(group.endswith(c["scheme"]) for c in result["cases"])
        count = len(result["cases"]) if group.startswith("schemes") else count
        for method, scores in table.items():
            if only_bundle and method != "bundle":
                continue
            cells = [cell(scores, k) for k in ("mse_mm2", "hausdorff_mm", "max_mm")]
            span = f"{scores['mse_mm2']['min']:.3f} to {scores['mse_mm2']['max']:.3f}"
            label = NAMES[method] or f"**{bundle}**"
            relative = f"{scores['relative_l2']['mean']:.3f}"
            cases = f"{group}, K = {result['nodes']} ({count})"
            out.append([cases, label, cells[0], span, cells[1], cells[2], relative])
    return out


def cell(scores: dict, name: str) -> str:
    """Mean and deviation; `-` where the score was left out (`--no-hausdorff`)."""
    return f"{scores[name]['mean']:.3f} ± {scores[name]['std']:.3f}" if name in scores else "-"


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", nargs="+", help="JSON of `evaluate`, or NAME=JSON")
    parser.add_argument("--overall", action="store_true", help="leave out the single schemes of a file with several")
    parser.add_argument("--paper", action="store_true", help="the bundle alone, and the paper's figures below it")


def rows(options: argparse.Namespace) -> list[list[str]]:
    found = [row for named in options.results for row in rows_of_result(named, options.paper, options.overall)]
    return found + (paper_rows() if options.paper else [])
