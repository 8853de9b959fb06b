"""`python -m upt_training ablate SUITE`: the same small budget for each variant of a configuration, tables and plots.

Suites: `windows` (pure teacher forcing and stochastic teacher forcing with windows 2 to 8, the paper's Fig. "window
size" and Fig. "error accumulation") and `tricks` (each departure from the paper's recipe, taken away one at a time).
Results go to `OUT/SUITE.{json,md}` and `OUT/*.png`, and with `--page docs/results/training.md` into that page and
the images next to it; finished variants are not run again.
"""

from __future__ import annotations

import copy
import json
import time
from pathlib import Path

import numpy as np
import torch

from upt_training.ablation_report import write_report
from upt_training.config import Settings, load_settings
from upt_training.dataset import open_dataset
from upt_training.errors import InputError
from upt_training.field_cache import build_cache
from upt_training.graph import build_graph
from upt_training.page import replaced
from upt_training.rollout import Stepper, autoregressive_scores, cache_rollout
from upt_training.run import choose_device, find_mesh, make_trainer, open_prior, training_nodes


def variants(suite: str, base: Settings) -> dict[str, Settings]:
    """Named settings of a suite."""
    out = {}

    def add(name: str, **changes) -> None:
        settings = copy.deepcopy(base)
        settings.name = name
        for key, value in changes.items():
            part = settings.train if hasattr(settings.train, key) else settings.model
            setattr(part, key, value)
        out[name] = settings

    if suite == "windows":
        add("teacher forcing", strategy="teacher", window=2)
        for window in range(2, 9):
            add(f"stochastic, window {window}", strategy="stf", window=window)
        return out
    add("base recipe")
    add("base recipe, another seed", seed=base.train.seed + 1)
    add("no linear response at the step before", features=without(base, "previous_prior"))
    add("linear response as base only", features=without(base, "prior", "previous_prior"))
    add("linear response as input only", base="displacement")
    add("linear response as input only, no increment", base="none")
    alone = {"features": without(base, "prior", "previous_prior"), "vibration": False}
    add("no linear response", base="displacement", **alone)
    add("no linear response, no increment", base="none", **alone)
    add("no vibration after a release", vibration=False)
    add("no previous state", features=without(base, "previous_displacement"))
    add("features as they are (no differences)", mixing="plain")
    add("no corrupted states", corrupt_contact=0.0)
    add("no averaged weights", ema=0.0)
    add("supernodes not denser in the domain", graph=_uniform(base))
    add("free boundary in training", exact_boundary=False)
    add("true states instead of replay", strategy="teacher")
    add("windows of 2 from the truth instead of replay", strategy="stf", window=2)
    add("noise of 0.2 mm on the inputs", input_noise_mm=0.2)
    add("relative positions in the messages", relative_positions=True)
    add("all nodes decoded and scored", loss_nodes=0, scored_rows=0)
    add("weights start at fan-in scale", scaled_start=True)
    return out


def without(base: Settings, *names: str) -> list[str]:
    return [f for f in base.model.features if f not in names]


def _uniform(base: Settings):
    graph = copy.deepcopy(base.model.graph)
    graph.domain_fraction = 0.0
    return graph


def run_variant(settings: Settings, base: Settings, options, mesh, folder: Path) -> dict:
    """Train for the budget, then score full rollouts of the held-out cases on the nodes of the configuration `base`."""
    folder.mkdir(parents=True, exist_ok=True)
    table = open_prior(settings.model, mesh, options.prior, options.vibration)
    trainer = make_trainer(settings, options.data, mesh, table, folder, choose_device(options.device))
    t = settings.train
    trainer.steps_per_epoch = max(1, options.steps // (t.epochs + t.autoregressive_epochs))
    trainer.total_steps = trainer.steps_per_epoch * (t.epochs + t.autoregressive_epochs)
    t.evaluate_every = 10**9
    began = time.process_time()
    trainer.fit(options.max_minutes, report=lambda *a, **k: None)
    seconds = time.process_time() - began
    count = min(options.cases, trainer.test_cache.case_count)
    cases = np.unique(np.linspace(0, trainer.test_cache.case_count - 1, count).round().astype(int))
    model = trainer.ema if trainer.ema is not None else trainer.model
    scored = training_nodes(mesh, build_graph(mesh, base.model.graph), base.train.loss_nodes)
    graph = build_graph(mesh, settings.model.graph)
    nodes = np.union1d(scored, graph.needed_nodes())
    cache = build_cache(
        folder / "cache", mesh, open_dataset(options.data, mesh).select("test", t.schemes), nodes, table
    )
    stepper = Stepper(model, mesh, graph, nodes, trainer.boundary, t.exact_boundary, trainer.device)
    result = cache_rollout(stepper, cache, cases, np.searchsorted(nodes, scored))
    return {
        **autoregressive_scores(result),
        "mse_per_step": np.nanmean(result["mse"], axis=0).tolist(),
        "mse_min": np.nanmin(result["mse"], axis=0).tolist(),
        "mse_max": np.nanmax(result["mse"], axis=0).tolist(),
        "largest_displacement_mm": float(np.nanmax(result["moved"])),
        "steps": trainer.step_count,
        "cpu_seconds": round(seconds, 1),
        "cases": len(cases),
    }


def reference_scores(trainer_cache, cases: np.ndarray) -> dict[str, float]:
    """MSE of predicting zero, of the response and of copying the true last frame, on the cache's nodes."""
    scores: dict[str, list[float]] = {}
    for case in cases:
        u = trainer_cache.displacement[case].astype(np.float32)
        errors = {"predict zero": u[2:], "copy the true last frame": u[2:] - u[1:-1]}
        if trainer_cache.prior is not None:
            errors["linear response, quasi-static"] = u[2:] - trainer_cache.prior[case][2:].astype(np.float32)
        for name, error in errors.items():
            scores.setdefault(name, []).append(float((error**2).sum(-1).mean()))
    return {name: float(np.mean(values)) for name, values in scores.items()}


def ablate_command(options) -> int:
    torch.set_num_threads(options.threads)
    base = load_settings(options.config)
    mesh = find_mesh(options.mesh, options.data)
    out = Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{options.suite}.json"
    results = json.loads(path.read_text()) if path.exists() else {"variants": {}, "references": {}}
    suite = variants(options.suite, base)
    unknown = [n for n in options.only or [] if n not in suite]
    if unknown:
        raise InputError(f"--only: {unknown[0]!r} is not a variant of {options.suite}; known are {', '.join(suite)}")
    if options.page:  # a page without marks fails before hours of work
        replaced(options.page.read_text(), f"ablate {options.suite}", [], options.page)
    for name, settings in suite.items():
        if name in results["variants"] or (options.only and name not in options.only):
            continue
        results["variants"][name] = run_variant(settings, base, options, mesh, out / "work")
        print(name, {k: v for k, v in results["variants"][name].items() if not isinstance(v, list)}, flush=True)
        path.write_text(json.dumps(results))
    trainer = make_trainer(
        base, options.data, mesh, open_prior(base.model, mesh, options.prior, options.vibration), out / "work", "cpu"
    )
    count = min(options.cases, trainer.test_cache.case_count)
    cases = np.unique(np.linspace(0, trainer.test_cache.case_count - 1, count).round().astype(int))
    results["references"] = reference_scores(trainer.test_cache, cases)
    results["budget"] = {
        "optimiser_steps": options.steps,
        "config": base.name,
        "train_cases": trainer.train_cache.case_count,
    }
    results["variants"] = {n: results["variants"][n] for n in suite if n in results["variants"]}
    write_report(options.suite, results, out, options.page)
    print((out / f"{options.suite}.md").read_text())
    return 0
