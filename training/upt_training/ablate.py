"""`python -m upt_training ablate SUITE`: the same small budget for each variant of a configuration, tables and plots.

Suites: `windows` (pure teacher forcing and stochastic teacher forcing with windows 2 to 8, the paper's Fig. "window
size" and Fig. "error accumulation") and `tricks` (each departure from the paper's recipe, taken away one at a time).
Results go to `OUT/SUITE.json`, `OUT/SUITE.md` and `OUT/*.png`; finished variants are not run again.
"""

from __future__ import annotations

import copy
import json
import time
from pathlib import Path

import numpy as np
import torch

from upt_training.config import Settings, load_settings
from upt_training.rollout import autoregressive_scores, cache_rollout
from upt_training.run import choose_device, find_mesh, make_trainer, open_prior


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
    add("as shipped")
    add("no linear response at the step before", features=without(base, "previous_prior"))
    add("linear response as base only", features=without(base, "prior", "previous_prior"))
    add("linear response as input only", base="displacement")
    add("no linear response", features=without(base, "prior", "previous_prior"), base="displacement", vibration=False)
    add("no vibration after a release", vibration=False)
    add("no previous state", features=without(base, "previous_displacement"))
    add("features as they are (no differences)", mixing="plain")
    add("no corrupted states", corrupt_contact=0.0)
    add("no averaged weights", ema=0.0)
    add("supernodes not denser in the domain", graph=_uniform(base))
    add("free boundary in training", exact_boundary=False)
    add("true states instead of replay", strategy="stf", window=2, scored_rows=0)
    return out


def without(base: Settings, *names: str) -> list[str]:
    return [f for f in base.model.features if f not in names]


def _uniform(base: Settings):
    graph = copy.deepcopy(base.model.graph)
    graph.domain_fraction = 0.0
    return graph


def run_variant(settings: Settings, options, mesh, folder: Path) -> dict:
    """Train for the budget, then score full rollouts of the held-out cases."""
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
    trainer.stepper.model = trainer.ema if trainer.ema is not None else trainer.model
    result = cache_rollout(trainer.stepper, trainer.test_cache, cases)
    return {
        **autoregressive_scores(result),
        "mse_per_step": result["mse"].mean(axis=0).tolist(),
        "mse_min": result["mse"].min(axis=0).tolist(),
        "mse_max": result["mse"].max(axis=0).tolist(),
        "largest_displacement_mm": float(result["moved"].max()),
        "steps": trainer.step_count,
        "cpu_seconds": round(seconds, 1),
        "cases": len(cases),
    }


def reference_scores(trainer_cache, cases: np.ndarray) -> dict[str, float]:
    """MSE of predicting zero, of the response and of copying the true last frame, on the cache's nodes."""
    u = np.stack([trainer_cache.displacement[c] for c in cases]).astype(np.float32)
    out = {
        "predict zero": float((u[:, 2:] ** 2).sum(-1).mean()),
        "copy the true last frame": float(((u[:, 2:] - u[:, 1:-1]) ** 2).sum(-1).mean()),
    }
    if trainer_cache.prior is not None:
        prior = np.stack([trainer_cache.prior[c] for c in cases]).astype(np.float32)
        out["linear response, quasi-static"] = float(((u - prior)[:, 2:] ** 2).sum(-1).mean())
    return out


def write_outputs(suite: str, results: dict, out: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    (out / f"{suite}.json").write_text(json.dumps(results, indent=1) + "\n")
    lines = ["| variant | MSE, mm² | max error, mm | steps | CPU s |", "|---|---|---|---|---|"]
    for name, r in results["variants"].items():
        lines.append(f"| {name} | {r['mse_mm2']:.4f} | {r['max_mm']:.2f} | {r['steps']} | {r['cpu_seconds']:.0f} |")
    for name, value in results["references"].items():
        lines.append(f"| *{name}* | {value:.4f} | | | |")
    (out / f"{suite}.md").write_text("\n".join(lines) + "\n")
    runs = results["variants"]
    if suite == "windows":
        figure, axis = pyplot.subplots(figsize=(6, 3.6), layout="constrained")
        names = [n for n in runs if n.startswith("stochastic")]
        sizes = [int(n.split()[-1]) for n in names]
        axis.plot(sizes, [runs[n]["mse_mm2"] for n in names], "o-", color="C0")
        if "teacher forcing" in runs:
            axis.plot([2], [runs["teacher forcing"]["mse_mm2"]], "s", color="C1", label="pure teacher forcing")
            axis.legend(frameon=False)
        axis.set(xlabel="rollout window in training", ylabel="autoregressive MSE, mm²", xticks=sizes)
        twin = axis.twinx()
        twin.plot(sizes, [runs[n]["max_mm"] for n in names], "^--", color="C2")
        twin.set_ylabel("max error, mm (dashed)")
        figure.savefig(out / "window-size.png", dpi=130)
        figure, axis = pyplot.subplots(figsize=(6, 3.6), layout="constrained")
        best = min(names, key=lambda n: runs[n]["mse_mm2"])
        for name, colour in (("teacher forcing", "C1"), (best, "C0")):
            if name in runs:
                steps = np.arange(1, len(runs[name]["mse_per_step"]) + 1)
                axis.plot(steps, runs[name]["mse_per_step"], color=colour, label=name)
                axis.fill_between(steps, runs[name]["mse_min"], runs[name]["mse_max"], color=colour, alpha=0.2, lw=0)
        axis.set(xlabel="step", ylabel="MSE, mm²", yscale="log")
        axis.legend(frameon=False)
        figure.savefig(out / "error-accumulation.png", dpi=130)
    else:
        figure, axis = pyplot.subplots(figsize=(7, 0.35 * len(runs) + 1.2), layout="constrained")
        axis.plot([r["mse_mm2"] for r in runs.values()], list(runs), "o", color="C0")
        axis.grid(axis="y", lw=0.4)
        linear = results["references"].get("linear response, quasi-static")
        if linear:
            axis.axvline(linear, color="C3", ls="--", label="linear elasticity, quasi-static")
            axis.legend(frameon=False)
        axis.set(xlabel="autoregressive MSE, mm²", xscale="log")
        axis.invert_yaxis()
        figure.savefig(out / f"{suite}.png", dpi=130)


def ablate_command(options) -> int:
    torch.set_num_threads(options.threads)
    base = load_settings(options.config)
    mesh = find_mesh(options.mesh, options.data)
    out = Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{options.suite}.json"
    results = json.loads(path.read_text()) if path.exists() else {"variants": {}, "references": {}}
    for name, settings in variants(options.suite, base).items():
        if name in results["variants"] or (options.only and name not in options.only):
            continue
        results["variants"][name] = run_variant(settings, options, mesh, out / "work")
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
    write_outputs(options.suite, results, out)
    print((out / f"{options.suite}.md").read_text())
    return 0
