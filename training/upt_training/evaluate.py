"""`python -m upt_training evaluate BUNDLE --data DIR`: all steps of held-out cases, autoregressive from rest, as JSON.

Beside the bundle, on the same cases: predict zero, and (where the bundle has a prior) the linear-elastic quasi-static
response alone, with a fitted decay after release, and with the free vibration of linear elasticity.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np

from upt_training.bundle_rollout import BundleRunner
from upt_training.dataset import Dataset, open_dataset, open_trajectory
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.metrics import RolloutMetrics, summary

DECAY = 0.68  # share of the response kept a step after release: best of a coarse grid on 60 cases, ten frames


def evaluate_case(runner: BundleRunner, trajectory, baselines: bool, with_hausdorff: bool) -> dict[str, RolloutMetrics]:
    """Rollout of one case: metrics of the bundle and of the plain methods."""
    site = trajectory.metadata.get("site")
    site = np.asarray(json.loads(site)) if site else None
    names = ["bundle"] + (["zero"] if baselines else [])
    if baselines and runner.prior is not None:
        names += ["linear", "linear_decay"] + (["linear_vibration"] if runner.prior.table.vibration else [])
    metrics = {n: RolloutMetrics(runner.mesh.positions, site, with_hausdorff) for n in names}
    runner.reset()
    truth = trajectory.read()
    static, free = np.zeros_like(runner.u), np.zeros_like(runner.u)
    for t in range(1, trajectory.frame_count):
        nodes, vectors = trajectory.contact(t)
        metrics["bundle"].add(runner.step(nodes, vectors), truth[t])
        if "zero" in metrics:
            metrics["zero"].add(np.zeros_like(free), truth[t])
        if "linear" in metrics:
            free = DECAY * (static + free) if len(nodes) == 0 else np.zeros_like(free)
            static = runner.prior_now if len(nodes) else np.zeros_like(free)
            metrics["linear"].add(static, truth[t])
            metrics["linear_decay"].add(static + free, truth[t])
        if "linear_vibration" in metrics:
            metrics["linear_vibration"].add(runner.prior_now, truth[t])
    return metrics


def evaluate_bundle(
    runner: BundleRunner, cases, *, baselines: bool = True, with_hausdorff: bool = True, report=None
) -> dict:
    """Per case, per scheme and overall scores."""
    rows, schemes = [], {}
    for case in cases:
        trajectory = open_trajectory(case.path, runner.mesh)
        began = time.monotonic()
        metrics = evaluate_case(runner, trajectory, baselines, with_hausdorff)
        seconds = time.monotonic() - began
        scores = {name: m.scores() for name, m in metrics.items()}
        site = json.loads(trajectory.metadata.get("site", "null"))
        rows.append({"index": case.index, "file": case.path.name, "scheme": case.scheme, "site": site, **scores})
        rows[-1]["mse_per_step_mm2"] = metrics["bundle"].mse
        schemes.setdefault(case.scheme, []).append(scores)
        if report:
            report(f"case {case.index} scheme {case.scheme}: " + ", ".join(
                f"{n} {s['mse_mm2']:.4f}" for n, s in scores.items()) + f" mm², {seconds:.0f} s")  # fmt: skip

    def table(group: list[dict]) -> dict:
        return {name: summary([s[name] for s in group]) for name in group[0]}

    every = [s for group in schemes.values() for s in group]
    return {
        "cases": rows,
        "schemes": {k: table(v) for k, v in sorted(schemes.items())},
        "all": table(every),
    }


def check_tissue(own: dict, dataset: Dataset) -> None:
    """Refuses data of another tissue: errors on it say nothing about the bundle. Damping may differ (hard schemes)."""
    theirs = dataset.manifest.get("material", own)
    for name in ("young_pa", "poisson", "density_kg_m3", "law", "relaxation"):
        if own.get(name) != theirs.get(name):
            raise InputError(
                f"{dataset.folder}: material.{name} is {theirs.get(name)}, the bundle is made for {own.get(name)}; "
                "make the data with --young, --poisson, --density, --law and --relaxation of the bundle"
            )


def evaluate_command(options) -> int:
    mesh = load_mesh(options.mesh) if options.mesh else None
    runner = BundleRunner(options.bundle, mesh, options.prior, options.precision, options.vibration)
    dataset = open_dataset(options.data, runner.mesh)
    check_tissue(runner.manifest["material"], dataset)
    cases = dataset.select(options.split, options.schemes, options.count)
    if not cases:
        wanted = f" of schemes {', '.join(options.schemes)}" if options.schemes else ""
        raise InputError(f"{options.data}: no finished case in the split '{options.split}'{wanted}; see --split")
    result = evaluate_bundle(
        runner,
        cases,
        with_hausdorff=not options.no_hausdorff,
        report=lambda text: print(text, file=sys.stderr, flush=True),
    )
    result = {
        "bundle": runner.manifest["name"],
        "precision": options.precision,
        "nodes": runner.mesh.node_count,
        "boundary": dataset.manifest.get("boundary"),
        "dataset_seed": dataset.manifest.get("seed"),
        **result,
    }
    text = json.dumps(result, indent=1)
    if options.out:
        Path(options.out).write_text(text + "\n")
        for name, scores in result["all"].items():
            print(f"{name}: " + ", ".join(f"{k} {v['mean']:.4f} ± {v['std']:.4f}" for k, v in scores.items()))
    else:
        print(text)
    return 0
