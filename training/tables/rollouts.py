"""Whole rollouts through the library, by scheme and number of corrections, and the second after an abrupt release.

    python training/tables rollouts --upt target/release/upt --bundle onnx/brain-paper --data DIR \
        --counts 0,3 --keep FOLDER --page PAGE --marks "paper rollouts"

Each case of the data is replayed through `upt rollout --json`; `--keep` holds these results, so an interrupted run
goes on. The second after a release is the mean over cases of the MSE of the frames within a second after a push of
2 mm or more has ended abruptly (`upt_training.reduced.evaluate.released`). Bundles are of the data's mesh.
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import fmean, median

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))

from corrections_table import replay  # noqa: E402
from tqdm import tqdm  # noqa: E402

from upt_training.loads import WITHHELD  # noqa: E402
from upt_training.reduced.evaluate import group_of, released  # noqa: E402
from upt_training.reduced.trajectories import Case, open_dataset  # noqa: E402

GROUPS = {"schemes_1_4": "1 to 4", "scheme_5": "5", "tools": "tools"}
COLUMNS = [
    "bundle",
    "K",
    "scheme (cases)",
    "k",
    "MSE, mm² (median)",
    "max error, mm",
    "the second after a release, mm² (cases)",
]
MARKS, KEY = "paper rollouts", 4


def kept(folder: Path | None, upt: str, bundle: Path, case: Case, count: str) -> dict:
    """One rollout, from the folder where it was made before with this bundle."""
    if folder is None:
        return replay(upt, str(bundle), case.path, count, 1)
    seal = json.loads((bundle / "bundle.json").read_text())["manifest_sha256"][:12]
    path = folder / f"{seal}-{case.path.parent.name}-{case.path.name.split('.')[0]}-{count}.json"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial")
        partial.write_text(json.dumps(replay(upt, str(bundle), case.path, count, 1)))
        partial.rename(path)
    return json.loads(path.read_text())


def row(name: str, scheme: str, count: str, cases: list[Case], results: list[dict]) -> list[str]:
    errors, largest, after = [], [], []
    for case, result in zip(cases, results, strict=True):
        steps = [step["mse_mm2"] for step in result["steps"]]
        mask = released(case)[-len(steps) :]
        errors.append(result["overall"]["mse_mm2"])
        largest.append(result["overall"]["max_mm"])
        if mask.any():
            after.append(fmean(mse for mse, wanted in zip(steps, mask, strict=True) if wanted))
    nodes = cases[0].displacement.shape[1]
    second = f"{fmean(after):.4f} ({len(after)})" if after else ""
    score = f"{fmean(errors):.4f} ({median(errors):.4f})"
    return [f"`{name}`", f"{nodes:,}", f"{scheme} ({len(cases)})", count, score, f"{fmean(largest):.2f}", second]


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--upt", default="target/release/upt")
    parser.add_argument("--bundle", action="append", required=True, type=Path)
    parser.add_argument("--data", action="append", required=True, type=Path)
    parser.add_argument("--unseen", action="store_true", help="only the split `test` and scheme 5")
    parser.add_argument("--groups", action="store_true", help="a row for schemes 1 to 4 and one for all tools")
    parser.add_argument("--counts", default="0,3", help="COUNT, or COUNT@MM")
    parser.add_argument("--keep", type=Path, help="folder of the rollouts' results")


def rows(options: argparse.Namespace) -> list[list[str]]:
    by_scheme: dict[str, list[Case]] = {}
    for folder in options.data:
        mesh = json.loads((folder / "manifest.json").read_text())["mesh_sha256"]
        for case in open_dataset(folder, mesh):
            if options.unseen and case.split != "test" and case.scheme != WITHHELD:
                continue
            name = GROUPS.get(group_of(case.scheme), case.scheme) if options.groups else case.scheme
            by_scheme.setdefault(name, []).append(case)
    every = [
        (bundle, scheme, count)
        for scheme in sorted(by_scheme)
        for count in options.counts.split(",")
        for bundle in options.bundle
    ]
    found = []
    total = sum(len(by_scheme[scheme]) for _, scheme, _ in every)
    with tqdm(total=total, unit="rollout", disable=None) as progress:
        for bundle, scheme, count in every:
            results = []
            for case in by_scheme[scheme]:
                results.append(kept(options.keep, options.upt, bundle, case, count))
                progress.update()
            found.append(row(bundle.resolve().name, scheme, count, by_scheme[scheme], results))
    return found
