"""What each minute of `upt make` buys: SOFA's liver and the brain of 21,708 nodes (docs/results/accuracy.md).

    python training/scripts/make_minutes.py --upt target/release/upt --sofa FOLDER --out minutes --page PAGE
    python training/scripts/make_minutes.py --sofa FOLDER --out minutes --only 21,708

FOLDER is a checkout of github.com/sofa-framework/sofa. All budgets share a work folder, as a user's own runs would, so
later ones go on from the rounds that are there; times are sums over the stages, whenever they were made.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
COARSE = ["--nodes", "1200", "--domain", "ball:-20,100,60,55", "--natural", "40"]
COLUMNS = [
    "nodes",
    "`--minutes`",
    "rounds of equilibria",
    "tool trajectories",
    "held-out cases",
    "in contact, mm²",
    "of linear elasticity",
    "after release, of linear elasticity",
    "worst region over mean",
    "corrections a step",
    "ms a step",
    "seconds of all stages",
    "memory, GB",
]


def bodies(sofa: Path) -> dict[str, tuple[list[str], list[float]]]:
    """The arguments of `upt make` and the budgets of each body."""
    liver = [str(sofa / "share/mesh/liver-smooth.obj"), "--unit", "25", "--material", "liver"]
    liver += ["--fixed", "plane:0,0,-1,-10"]
    brain = [str(ROOT / "onnx/meshes/brain.mesh.safetensors"), "--name", "brain"]
    return {
        "1,178": ([*liver, *COARSE], [0.25, 1, 4]),
        "4,997": (liver, [0.5, 1, 3, 8]),
        "21,708": (brain, [12]),
    }


def stage(work: Path, name: str) -> dict:
    return json.loads((work / f"{name}.stage.json").read_text(encoding="utf-8"))


def row(nodes: str, minutes: float, bundle: Path, work: Path, gigabytes: float) -> str:
    certificate = json.loads((bundle / "certificate.json").read_text(encoding="utf-8"))
    tested, contact, free = (certificate[name] for name in ("tested", "contact", "free"))
    # Of several checks the last one counts.
    checks = sorted(work.glob("check-*.stage.json"), key=lambda path: path.stat().st_mtime)
    check = checks[-1].name.removesuffix(".stage.json")
    names = ["body", "columns", "modes", "tables", "coarse", "refine", "learn", check]
    rounds = sum(line.startswith("round ") for line in stage(work, "refine")["decided"])
    tools = [line for line in stage(work, "learn")["decided"] if "tool trajectories at" in line]
    worst = certificate["worst_region_over_mean"]
    cells = [
        nodes,
        f"{minutes:g}",
        str(rounds),
        tools[0].split()[0] if tools else "0",
        str(tested["cases"]),
        f"{contact['mse_mm2']:.2e}",
        f"1/{1 / contact['share_of_linear']:.0f}",
        f"{free['share_of_linear']:.2f}",
        "-" if worst is None else f"{worst:.1f}",
        f"{tested['corrections_mean']:.1f}",
        f"{certificate['speed']['ms_median']:.2g}",
        f"{sum(stage(work, name)['seconds'] for name in names):.0f}",
        f"{gigabytes:.2g}",
    ]
    return "| " + " | ".join(cells) + " |"


def run(command: list[str]) -> float:
    """Runs it; its peak of resident memory, GB."""
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return usage.ru_maxrss * 1024 / 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--upt", type=Path, default=ROOT / "target/release/upt")
    parser.add_argument("--sofa", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("minutes"))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--page", type=Path, required=True, help="page to write into (tests/docs/results.py makes it)")
    parser.add_argument("--only", nargs="*", help="make these alone; the table keeps the lines of others")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows: dict[str, list[str]] = {}
    for nodes, (arguments, budgets) in bodies(options.sofa).items():
        if options.only is not None and nodes not in options.only:
            continue
        bundle, work = options.out / nodes, options.out / f"{nodes}.work"
        rows[nodes] = []
        for minutes in budgets:
            command = [str(options.upt), "make", *arguments, "--minutes", f"{minutes:g}", "--out", str(bundle)]
            gigabytes = run([*command, "--threads", str(options.threads)])
            rows[nodes].append(row(nodes, minutes, bundle, work, gigabytes))
    begin, end = "<!-- make_minutes.py: begin -->", "<!-- make_minutes.py: end -->"
    # Read only now: another run may have written its lines in between.
    before, rest = options.page.read_text(encoding="utf-8").split(begin)
    table, after = rest.split(end)
    kept = [line for line in table.splitlines() if line.startswith("| ") and not line.startswith("| nodes")]
    lines = []
    for nodes in bodies(options.sofa):
        lines += rows.get(nodes) or [line for line in kept if line.startswith(f"| {nodes} |")]
    head = ["| " + " | ".join(COLUMNS) + " |", "|---|" + "---:|" * (len(COLUMNS) - 1)]
    table = "\n".join([*head, *lines])
    options.page.write_text(f"{before}{begin}\n{table}\n{end}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
