"""What each minute of `upt make` buys: SOFA's liver by rising budgets, as the table of docs/guide/make.md.

    python training/scripts/make_minutes.py --upt target/release/upt --sofa FOLDER --out minutes

FOLDER is a checkout of github.com/sofa-framework/sofa. All budgets share a work folder, as a user's own runs would, so
later ones go on from the rounds that are there; times are sums over the stages, whenever they were made.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "guide" / "make.md"
BODIES = {
    "1,178": ["--nodes", "1200", "--domain", "ball:-20,100,60,55", "--natural", "40", "--cases", "4"],
    "4,997": ["--cases", "2"],
}


def stages(work: Path, corrections: int) -> float:
    """Seconds of the stages before the check, and of the check."""
    names = ["body", "columns", "modes", "tables", "coarse", "refine", f"check-{corrections}"]
    return sum(json.loads((work / f"{name}.stage.json").read_text())["seconds"] for name in names)


def row(nodes: str, minutes: float, bundle: Path, work: Path) -> str:
    certificate = json.loads((bundle / "certificate.json").read_text(encoding="utf-8"))
    corrections = certificate["tested"]["corrections"]
    rounds = []
    # Files of rounds of a larger budget may lie there too; the stage names those that it used.
    for line in json.loads((work / "refine.stage.json").read_text(encoding="utf-8"))["decided"]:
        if "estimated error" in line:
            number = 0 if line.startswith("before") else int(line.split()[1].rstrip(","))
            rounds.append(json.loads((work / f"round-{number}.json").read_text(encoding="utf-8")))
    taken = [found for found in rounds if found["taken"]]
    contact = certificate["contact"]
    cells = [
        nodes,
        f"{minutes:g}",
        str(max(len(rounds) - 1, 0)),
        f"{taken[-1]['error']:.2e}" if taken else "-",
        f"{taken[-1]['worst'] / taken[-1]['error']:.1f}" if taken else "-",
        f"{contact['mse_mm2']:.2e}",
        f"1/{1 / contact['share_of_linear']:.0f}",
        f"{certificate['speed']['ms_median']:.2g}",
        f"{stages(work, corrections):.0f}",
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--upt", type=Path, default=ROOT / "target/release/upt")
    parser.add_argument("--sofa", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("minutes"))
    parser.add_argument("--minutes", type=float, nargs="+", default=[0.5, 2, 4, 8])
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    liver = [str(options.sofa / "share/mesh/liver-smooth.obj"), "--unit", "25", "--material", "liver"]
    liver += ["--fixed", "plane:0,0,-1,-10"]
    rows = []
    for nodes, more in BODIES.items():
        bundle, work = options.out / nodes, options.out / f"{nodes}.work"
        for minutes in options.minutes:
            command = [str(options.upt), "make", *liver, *more, "--minutes", f"{minutes:g}", "--out", str(bundle)]
            subprocess.run(command, check=True)
            rows.append(row(nodes, minutes, bundle, work))
    head = [
        "| nodes | `--minutes` | rounds | estimated, mm² | worst region over mean | held out, mm² | "
        "share of linear elasticity | ms a step | seconds of all stages |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    begin, end = "<!-- make_minutes.py: begin -->", "<!-- make_minutes.py: end -->"
    before, rest = PAGE.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    table = "\n".join([*head, *rows])
    PAGE.write_text(f"{before}{begin}\n{table}\n{end}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
