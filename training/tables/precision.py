"""What half-precision and int8 graphs cost in accuracy, over whole rollouts.

    python training/tables precision BUNDLE=DATA ... [--count 8]

A copy of each bundle gets the graphs (`variants`); float32, float16 and int8 then roll the same held-out cases from
rest, each on its own states, in ONNX Runtime on the CPU. For the error of one step both networks get the inputs of the
float32 rollout, and the difference is taken relative to what the float32 network adds, over all nodes and steps.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from upt_training.bundle_rollout import BundleRunner
from upt_training.dataset import open_dataset, open_trajectory
from upt_training.metrics import RolloutMetrics, summary
from upt_training.variants import make_variants

PRECISIONS = ("f32", "f16", "int8")
COLUMNS = [
    "bundle (cases)",
    "precision",
    "MSE, mm²",
    "max error, mm",
    "one step, relative to float32",
    "rollout, largest difference from float32, mm",
    "latent and decoder, kB",
]
MARKS, KEY = "precisions", 2


class OneStep:
    """Sums the squared difference of narrow networks on the inputs that the float32 runner's network gets."""

    def __init__(self, runners: dict[str, BundleRunner]):
        self.wide, self.narrow = runners["f32"], {k: r for k, r in runners.items() if k != "f32"}
        self.size, self.difference = 0.0, dict.fromkeys(self.narrow, 0.0)
        self.plain, self.wide.network = self.wide.network, self.network

    def network(self, features: np.ndarray) -> np.ndarray:
        out = self.plain(features)
        self.size += float((out.astype(np.float64) ** 2).sum())
        for name, runner in self.narrow.items():
            self.difference[name] += float(((runner.network(features) - out).astype(np.float64) ** 2).sum())
        return out

    def relative(self, precision: str) -> float:
        return (self.difference[precision] / self.size) ** 0.5


def rows_of_bundle(bundle: Path, data: Path, count: int) -> list[list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / bundle.name
        make_variants(bundle, copy, ["f16", "int8"])
        runners = {p: BundleRunner(copy, precision=p) for p in PRECISIONS}
        sizes = {p: graph_bytes(copy, p) for p in PRECISIONS}
    one_step, apart = OneStep(runners), dict.fromkeys(PRECISIONS, 0.0)
    mesh = runners["f32"].mesh
    cases = open_dataset(data, mesh).select("test", count=count)
    scores: dict[str, list] = {p: [] for p in PRECISIONS}
    for case in cases:
        trajectory = open_trajectory(case.path, mesh)
        metrics = {p: RolloutMetrics(mesh.positions, None, False) for p in PRECISIONS}
        for runner in runners.values():
            runner.reset()
        for t in range(1, trajectory.frame_count):
            u = {p: runner.step(*trajectory.contact(t)) for p, runner in runners.items()}
            for p in PRECISIONS:
                metrics[p].add(u[p], trajectory.displacement[t])
                apart[p] = max(apart[p], float(np.abs(u[p] - u["f32"]).max()))
        for p in PRECISIONS:
            scores[p].append(metrics[p].scores())
        mse = ", ".join(f"{p} {scores[p][-1]['mse_mm2']:.4f}" for p in PRECISIONS)
        print(f"{bundle.name}, case {case.index}: {mse} mm²", file=sys.stderr, flush=True)
    found = []
    for p in PRECISIONS:
        s = summary(scores[p])
        cells = [f"`{bundle.name}` ({len(cases)})", p]
        cells += [f"{s['mse_mm2']['mean']:.4f} ± {s['mse_mm2']['std']:.4f}"]
        cells += [f"{s['max_mm']['mean']:.3f} ± {s['max_mm']['std']:.3f}"]
        cells += ["-", "-"] if p == "f32" else [f"{one_step.relative(p):.1e}", f"{apart[p]:.4f}"]
        found.append([*cells, f"{sizes[p] / 1000:.0f}"])
    return found


def graph_bytes(folder: Path, precision: str) -> int:
    """Bytes of the two graphs that are narrowed; `embed` and `encoder` stay float32."""
    suffix = "" if precision == "f32" else f".{precision}"
    return sum((folder / f"{name}{suffix}.onnx").stat().st_size for name in ("latent", "decoder"))


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("pairs", nargs="+", metavar="BUNDLE=DATA", help="a bundle and the dataset of its test cases")
    parser.add_argument("--count", type=int, default=8, help="cases, at most")


def rows(options: argparse.Namespace) -> list[list[str]]:
    pairs = [pair.split("=", 1) for pair in options.pairs]
    return [row for bundle, data in pairs for row in rows_of_bundle(Path(bundle), Path(data), options.count)]
