"""A Markdown table of results of `evaluate`, printed or written into a page:

python training/scripts/evaluation_table.py A.json ... [--page docs/results/training.md]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from upt_training.page import write_table  # noqa: E402

NAMES = {
    "bundle": "",
    "coarse_fem": "coarse FEM, embedded",
    "linear": "linear elasticity",
    "linear_decay": "linear elasticity, decay",
    "linear_vibration": "linear elasticity, free vibration",
    "zero": "predict zero",
}


def rows(path: Path) -> list[str]:
    result = json.loads(path.read_text())
    groups = {f"scheme {k}": v for k, v in result["schemes"].items()}
    if len(groups) > 1:
        groups = {"schemes " + "-".join((min(result["schemes"]), max(result["schemes"]))): result["all"], **groups}
    out = []
    for group, table in groups.items():
        count = sum(group.endswith(c["scheme"]) for c in result["cases"])
        count = len(result["cases"]) if group.startswith("schemes") else count
        for method, scores in table.items():
            cells = [cell(scores, k) for k in ("mse_mm2", "hausdorff_mm", "max_mm")]
            span = f"{scores['mse_mm2']['min']:.3f} to {scores['mse_mm2']['max']:.3f}"
            name = NAMES[method] or f"**{result['bundle']}**"
            relative = f"{scores['relative_l2']['mean']:.3f}"
            row = (f"{group}, K = {result['nodes']} ({count})", name, cells[0], span, cells[1], cells[2], relative)
            out.append("| " + " | ".join(row) + " |")
    return out


def cell(scores: dict, name: str) -> str:
    """Mean and deviation; `-` where the score was left out (`--no-hausdorff`)."""
    return f"{scores[name]['mean']:.3f} ± {scores[name]['std']:.3f}" if name in scores else "-"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, nargs="+")
    parser.add_argument("--page", type=Path, help="page whose table `evaluation` to exchange")
    options = parser.parse_args()
    lines = [
        "| cases (number) | method | MSE, mm² | range | Hausdorff, mm | max error, mm | relative L2 |",
        "|---|---|---|---|---|---|---|",
    ]
    for path in options.results:
        lines += rows(path)
    if options.page:
        write_table(options.page, "evaluation", lines)
    else:
        print("\n".join(lines))


if __name__ == "__main__":
    main()
