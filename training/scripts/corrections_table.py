"""What corrections are worth: error, time and estimate by their number.

    python training/scripts/corrections_table.py --upt target/release/upt --bundle onnx/brain-reduced --data DIR \
        --counts 0,1,3,5,10,10@0.02 --page PAGE

Each case of the data is replayed through `upt rollout --json` with each count. The contact force is that of
`upt_scene_read_contact_force`, summed over the nodes of a step, against the solver's over all steps with contact. The
estimate is compared with the true root mean square error in the steps with contact: rank correlation, of the regimes
that bundles learn from and of the hard ones, and their ratio (times the bundle's `calibration` the better one).
`hard-ring` is left out of that: its tissue has another damping than the bundle says. With corrections `upt rollout`
takes the damping of the trajectory; without them the bundle's is all that there is.

With `--rows` the table stays as it is but for the rows of the data's schemes and their largest errors. Times, forces
and estimates, which are of all schemes together, stay too.
"""

import argparse
import json
import pathlib
import statistics
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from upt_training.loads import OTHER_DAMPING, SCHEMES  # noqa: E402

BEGIN = "<!-- corrections_table.py: begin {} -->"
END = "<!-- corrections_table.py: end {} -->"

GROUPS = ("learned regimes", "hard regimes")
PUSHES = ("1", "2", "3", "4")
LARGEST = "largest error of a case, mm, mean over schemes 1-4"


def scheme_of(path: pathlib.Path) -> str:
    """The scheme in a trajectory's metadata."""
    with path.open("rb") as file:
        (length,) = struct.unpack("<Q", file.read(8))
        return json.loads(file.read(length))["__metadata__"]["scheme"]


def ranks(values: list[float]) -> list[float]:
    """Ranks from 0; ties do not occur in measured numbers."""
    order = sorted(range(len(values)), key=values.__getitem__)
    out = [0.0] * len(values)
    for rank, index in enumerate(order):
        out[index] = float(rank)
    return out


def spearman(pairs: list[tuple[float, float]]) -> str:
    """Rank correlation of pairs, as a cell."""
    if len(pairs) < 10:
        return "-"
    estimate, true = zip(*pairs, strict=True)
    return f"{statistics.correlation(ranks(list(estimate)), ranks(list(true))):.2f}"


def replay(upt: str, bundle: str, case: pathlib.Path, count: str, threads: int) -> dict:
    """One rollout as `upt rollout --json` gives it."""
    command = [upt, "rollout", bundle, str(case), "--corrections", count, "--json"]
    command += ["--no-hausdorff", "--threads", str(threads)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def rows(upt: str, bundle: str, cases: list[pathlib.Path], counts: list[str], threads: int) -> list[str]:
    """Table rows, one a scheme and one for the estimate."""
    by_scheme: dict[str, list[pathlib.Path]] = {}
    for case in cases:
        by_scheme.setdefault(scheme_of(case), []).append(case)
    lines, times = [], {k: [] for k in counts}
    pairs = {group: {k: [] for k in counts} for group in GROUPS}
    forces = {k: [0.0, 0.0] for k in counts}
    worst = {k: [] for k in counts}
    for scheme, members in sorted(by_scheme.items()):
        cells = []
        for count in counts:
            errors, largest = [], []
            for case in members:
                result = replay(upt, bundle, case, count, threads)
                errors.append(result["overall"]["mse_mm2"])
                largest.append(result["overall"]["max_mm"])
                if scheme in PUSHES:
                    worst[count].append(largest[-1])
                for step, estimate, ms in zip(result["steps"], result["estimated_mm"], result["ms"], strict=True):
                    if estimate is not None:
                        if scheme not in OTHER_DAMPING:
                            group = GROUPS[SCHEMES[scheme]["group"] == "hard"]
                            pairs[group][count].append((estimate, step["mse_mm2"] ** 0.5))
                        times[count].append(ms)
                    elif count == "0":
                        times[count].append(ms)
                for force in filter(None, result["force_mn"]):
                    apart = zip(force["found"], force["wanted"], strict=True)
                    forces[count][0] += sum((found - wanted) ** 2 for found, wanted in apart)
                    forces[count][1] += sum(wanted**2 for wanted in force["wanted"])
            cells.append(f"{statistics.fmean(errors):.2g} ({max(largest):.2g})")
        lines.append(f"| {scheme} ({len(members)}) | " + " | ".join(cells) + " |")
    if all(worst.values()):
        lines.append(f"| {LARGEST} | " + " | ".join(f"{statistics.fmean(worst[k]):.2g}" for k in counts) + " |")
    correlations = {group: [spearman(pairs[group][k]) for k in counts] for group in GROUPS}
    inside = pairs[GROUPS[0]]
    ratios = [[true / estimate for estimate, true in inside[k] if estimate > 0] for k in counts]
    ratio = [f"{statistics.median(values):.2g}" if values else "-" for values in ratios]
    lines.append(
        "| ms a step in contact (median) | " + " | ".join(f"{statistics.median(times[k]):.3g}" for k in counts) + " |"
    )
    relative = ["-" if whole == 0 else f"{100 * (part / whole) ** 0.5:.2g} %" for part, whole in forces.values()]
    lines.append("| contact force, sum, relative L2 | " + " | ".join(relative) + " |")
    for group, cells in correlations.items():
        if any(cell != "-" for cell in cells):
            lines.append(f"| estimate against truth, rank correlation, {group} | " + " | ".join(cells) + " |")
    lines.append("| truth over estimate (median) | " + " | ".join(ratio) + " |")
    return lines


def with_rows(old: str, new: list[str]) -> str:
    """The table of the page with the new rows in place of those of the same schemes."""
    named = {line.split(" |", 1)[0]: line for line in new}
    lines = old.strip().splitlines()
    missing = named.keys() - {line.split(" |", 1)[0] for line in lines}
    if missing:
        raise SystemExit(f"the page has no row {', '.join(sorted(missing))}: the data has other cases than its table")
    return "\n".join(named.get(line.split(" |", 1)[0], line) for line in lines)


def main() -> None:
    """Replays and writes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--upt", default="target/release/upt")
    parser.add_argument("--bundle", required=True)
    parser.add_argument("--data", action="append", required=True, type=pathlib.Path)
    parser.add_argument("--counts", default="0,1,3,5,10,10@0.02", help="COUNT, or COUNT@MM")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--page", type=pathlib.Path)
    parser.add_argument("--rows", action="store_true", help="replace the rows of the data's schemes only")
    options = parser.parse_args()
    counts = options.counts.split(",")
    cases = sorted(case for folder in options.data for case in folder.glob("*.trajectory.safetensors"))
    if not cases:
        parser.error("no *.trajectory.safetensors in --data")
    head = "| scheme (cases): MSE, mm² (largest error, mm) | " + " | ".join(f"k = {k}" for k in counts) + " |"
    table = [head, "|---" * (len(counts) + 1) + "|", *rows(options.upt, options.bundle, cases, counts, options.threads)]
    text = "\n".join(table)
    print(text)
    if options.page:
        name = pathlib.Path(options.bundle).name
        page = options.page.read_text()
        begin, end = BEGIN.format(name), END.format(name)
        if begin not in page:
            raise SystemExit(f"{options.page}: the marker {begin} is missing")
        before, rest = page.split(begin, 1)
        if options.rows:
            schemes = [line for line in table[2:] if line[2:].split(" (", 1)[0] in SCHEMES or LARGEST in line]
            text = with_rows(rest.split(end, 1)[0], schemes)
        options.page.write_text(f"{before}{begin}\n{text}\n{end}{rest.split(end, 1)[1]}")


if __name__ == "__main__":
    main()
