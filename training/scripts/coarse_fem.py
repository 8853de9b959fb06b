"""Adds the reference solver on the coarse mesh to results of `evaluate`, as the method `coarse_fem`.

    python training/scripts/coarse_fem.py EVALUATION.json --data DATA --study target/release/upt-study

Each case of EVALUATION.json is replayed by `cargo xtask study report --plain zero,coarse`: the solver runs on
onnx/meshes/brain-coarse.mesh.safetensors, led by the same contact, and its field is interpolated to the nodes of the
case's mesh. Predicting zero is scored beside it and must agree with EVALUATION.json, so both sides have read the same
case by the same metrics. `evaluation_table.py` then writes its rows with the others.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from upt_training.metrics import summary  # noqa: E402

SCORES = ("mse_mm2", "max_mm", "relative_l2", "hausdorff_mm")
AGREE = 1e-4


def report(study: Path, trajectory: Path) -> dict[str, dict[str, float]]:
    """Scores of `predict zero` and `coarse TLED` on one trajectory."""
    # A bundle of the coarse mesh fits no case here, so that the plain methods alone are run.
    command = [study, "report", "--trajectory", trajectory, "--bundle", "onnx/brain-coarse", "--plain", "zero,coarse"]
    with tempfile.TemporaryDirectory() as out:
        run = subprocess.run(
            [*command, "--threads", "1", "--out", out, "--json"], check=True, stdout=subprocess.PIPE, text=True
        )
    found = json.loads(run.stdout)
    if len(found["rows"]) != 2:
        sys.exit(f"error: {trajectory}: {'; '.join(found['left_out'])}")
    return {row["method"]: {name: row[name] for name in SCORES} for row in found["rows"]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("evaluation", type=Path, help="JSON of `evaluate`, changed in place")
    parser.add_argument("--data", type=Path, required=True, help="the dataset folder that it was made with")
    parser.add_argument("--study", type=Path, default=Path("target/release/upt-study"))
    options = parser.parse_args()
    result = json.loads(options.evaluation.read_text())
    for case in result["cases"]:
        scores = report(options.study, options.data / case["file"])
        for name, value in scores["predict zero"].items():
            if abs(value - case["zero"][name]) > AGREE * case["zero"][name]:
                sys.exit(f"error: {case['file']}: predicting zero has {name} {value}, evaluated {case['zero'][name]}")
        case["coarse_fem"] = scores["coarse TLED"]
        print(f"case {case['index']} scheme {case['scheme']}: {case['coarse_fem']['mse_mm2']:.4f} mm²", flush=True)
    for scheme, table in result["schemes"].items():
        table["coarse_fem"] = summary([c["coarse_fem"] for c in result["cases"] if c["scheme"] == scheme])
    result["all"]["coarse_fem"] = summary([c["coarse_fem"] for c in result["cases"]])
    options.evaluation.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
