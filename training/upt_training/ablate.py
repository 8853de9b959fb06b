"""`python -m upt_training ablate SUITE`: the same small budget for each variant of a configuration, tables and plots.

Suites: `windows` (pure teacher forcing and stochastic teacher forcing with windows 2 to 8, the paper's Fig. "window
size" and Fig. "error accumulation") and `tricks` (each departure from the paper's recipe, taken away one at a time).
Results go to `OUT/SUITE.{json,md}` and `OUT/*.png`, and with `--page PAGE` into that page and
the images next to it; finished variants are not run again. With `--minutes` a variant gets time in place of steps, and
what it has so far is in `OUT/SUITE.json` after each minute. `--merge` joins the files of runs side by side.
"""

from __future__ import annotations

import copy
import json
import time
from pathlib import Path

import numpy as np
import torch

from upt_training.ablation_report import marks, write_report
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


def run_variant(settings: Settings, base: Settings, options, mesh, folder: Path, partial) -> dict:
    """Train for the budget, then score full rollouts of the held-out cases on the nodes of the configuration `base`.

    With a budget of minutes, `partial` is given the result so far once a minute.
    """
    folder.mkdir(parents=True, exist_ok=True)
    began, cpu = time.monotonic(), time.process_time()
    table = open_prior(settings.model, mesh, options.prior, options.vibration)
    trainer = make_trainer(settings, options.data, mesh, table, folder, choose_device(options.device))
    t = settings.train

    def spent() -> dict:
        return {
            "minutes": round((time.monotonic() - began) / 60, 3),
            "cpu_seconds": round(time.process_time() - cpu, 1),
        }

    def scores(result: dict[str, np.ndarray]) -> dict:
        return {
            **autoregressive_scores(result),
            "mse_per_step": np.nanmean(result["mse"], axis=0).tolist(),
            "mse_min": np.nanmin(result["mse"], axis=0).tolist(),
            "mse_max": np.nanmax(result["mse"], axis=0).tolist(),
            "mse_by_case": np.nanmean(result["mse"][:, 1:], axis=1).tolist(),
            "largest_displacement_mm": float(np.nanmax(result["moved"])),
            "steps": trainer.step_count,
            "samples": trainer.step_count * t.samples_per_step,
            "cases": len(result["mse"]),
        }

    if options.minutes:
        t.evaluate_cases, curve, kept = options.cases, [], [trainer.rollouts]

        def keep(*_, **__) -> None:
            if trainer.rollouts is not kept[0]:  # other messages come between scores
                kept[0] = trainer.rollouts
                now = {**scores(trainer.rollouts), **spent()}
                curve.append({k: now[k] for k in ("minutes", "steps", "samples", "mse_mm2", "max_mm")})
                partial({**now, "curve": curve, "unfinished": True})

        trainer.fit(options.minutes - spent()["minutes"], report=keep, evaluate_minutes=1.0)
    else:
        trainer.steps_per_epoch = max(1, options.steps // (t.epochs + t.autoregressive_epochs))
        trainer.total_steps = trainer.steps_per_epoch * (t.epochs + t.autoregressive_epochs)
        t.evaluate_every, curve = 10**9, None
        trainer.fit(options.max_minutes, report=lambda *a, **k: None)
    budget = spent()
    count = min(options.cases, trainer.test_cache.case_count)
    cases = np.unique(np.linspace(0, trainer.test_cache.case_count - 1, count).round().astype(int))
    model = trainer.ema if trainer.ema is not None else trainer.model
    scored = training_nodes(mesh, build_graph(mesh, base.model.graph), base.train.loss_nodes)
    graph = build_graph(mesh, settings.model.graph)
    nodes = np.union1d(scored, graph.needed_nodes())
    if options.minutes and np.array_equal(nodes, trainer.test_cache.nodes) and len(scored) == len(nodes):
        return {**scores(trainer.rollouts), **budget, "curve": curve}
    cache = build_cache(
        folder / "cache", mesh, open_dataset(options.data, mesh).select("test", t.schemes), nodes, table
    )
    stepper = Stepper(model, mesh, graph, nodes, trainer.boundary, t.exact_boundary, trainer.device)
    result = cache_rollout(stepper, cache, cases, np.searchsorted(nodes, scored))
    return {**scores(result), **budget, **({"curve": curve} if curve else {})}


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
    out = Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{options.suite}.json"
    results = json.loads(path.read_text()) if path.exists() else {"variants": {}, "references": {}}
    if options.page:  # a page without marks fails before hours of work
        replaced(options.page.read_text(), marks(options.suite, options.label), [], options.page)
    if options.merge:
        for source in options.merge:
            part = json.loads(source.read_text())
            results = {**part, "variants": {**results["variants"], **part["variants"]}}
        order = list(variants(options.suite, Settings("")))
    else:
        if not (options.config and options.data):
            raise InputError("ablate needs --config and --data, or --merge with files of finished runs")
        base = load_settings(options.config)
        order = list(variants(options.suite, base))
        train_variants(results, base, options, path)
    results["variants"] = {n: results["variants"][n] for n in order if n in results["variants"]}
    write_report(options.suite, results, out, options.page, options.label)
    print((out / f"{options.suite}.md").read_text())
    return 0


def train_variants(results: dict, base: Settings, options, path: Path) -> None:
    """Train what `--only` asks for and `results` lacks; `path` has the results after each variant."""
    mesh, work, suite = find_mesh(options.mesh, options.data), path.parent / "work", variants(options.suite, base)
    unknown = [n for n in options.only or [] if n not in suite]
    if unknown:
        raise InputError(f"--only: {unknown[0]!r} is not a variant of {options.suite}; known are {', '.join(suite)}")
    table = open_prior(base.model, mesh, options.prior, options.vibration)
    plain = copy.deepcopy(base)
    plain.train.resident_gb = 0.0
    trainer = make_trainer(plain, options.data, mesh, table, work, "cpu")
    count = min(options.cases, trainer.test_cache.case_count)
    cases = np.unique(np.linspace(0, trainer.test_cache.case_count - 1, count).round().astype(int))
    results["references"] = reference_scores(trainer.test_cache, cases)
    results["budget"] = {"config": base.name, "train_cases": trainer.train_cache.case_count}
    results["budget"] |= {"minutes": options.minutes} if options.minutes else {"optimiser_steps": options.steps}
    for name, settings in suite.items():
        finished = name in results["variants"] and not results["variants"][name].get("unfinished")
        if finished or (options.only and name not in options.only):
            continue

        def keep(row: dict, name: str = name) -> None:
            results["variants"][name] = row
            path.with_suffix(".tmp").write_text(json.dumps(results))
            path.with_suffix(".tmp").rename(path)

        keep(run_variant(settings, base, options, mesh, work, keep))
        print(name, {k: v for k, v in results["variants"][name].items() if not isinstance(v, list)}, flush=True)
