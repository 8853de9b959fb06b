"""`python -m upt_training scaling`: error against parameters, core-hours and cases, with and without linear elasticity.

Each run takes its sizes from one configuration and its inputs and recipe from another, trains for the same core time
(its number of steps is measured first, so that the schedule ends where the time does), and is scored by rollouts from
rest on all nodes, half-way and at the end. Runs stop and resume by themselves; `OUT/scaling.json` holds what is done.
"""

from __future__ import annotations

import copy
import itertools
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from upt_training.ablate import reference_scores
from upt_training.config import Settings, load_settings, settings_from_dict
from upt_training.errors import InputError
from upt_training.page import replaced
from upt_training.rollout import autoregressive_scores, cache_rollout
from upt_training.run import find_mesh, make_trainer, open_prior
from upt_training.scaling_report import read_reference, write_report
from upt_training.trainer import Trainer

SIZES = {"0.1": "window.toml", "0.2": "brain-coarse.toml", "0.9": "wide.toml", "3.4": "paper.toml"}
INPUTS = {"plain": "plain.toml", "prior": "brain-coarse.toml"}
INPUT_FIELDS = ("features", "base", "mixing", "vibration")
COST = {"0.9": {"drawn_supernodes": 128, "bf16": True}, "3.4": {"drawn_supernodes": 256, "bf16": True}}  # of `[train]`
SCORED_ROWS = 400
LINEAR = "linear elasticity, free vibration"
SAVE_SECONDS = 60.0


@dataclass(frozen=True)
class Run:
    inputs: str
    size: str  # millions of parameters
    seed: int
    cases: int  # training cases; 0: all
    core_minutes: float

    @property
    def name(self) -> str:
        return f"{self.inputs}-{self.size}M-seed{self.seed}-cases{self.cases}-{self.core_minutes:g}min"


def settings_of(run: Run, configs: Path) -> Settings:
    """Size from one configuration, inputs and recipe from another; the rate falls with the width of the latent."""
    size, recipe = load_settings(configs / SIZES[run.size]), load_settings(configs / INPUTS[run.inputs])
    settings = Settings(run.name, "", copy.deepcopy(size.model), copy.deepcopy(recipe.train))
    for name in INPUT_FIELDS:
        setattr(settings.model, name, copy.deepcopy(getattr(recipe.model, name)))
    settings.model.drop_path = 0.0
    t = settings.train
    for name, value in COST.get(run.size, {}).items():
        setattr(t, name, value)
    t.learning_rate *= min(1.0, recipe.model.latent / size.model.latent)
    t.seed, t.train_cases, t.loss_nodes, t.scored_rows = run.seed, run.cases, 0, SCORED_ROWS
    t.resident_gb, t.schemes, t.steps_per_epoch = 2.0, [], 0
    return settings


def measured_steps(trainer: Trainer, core_minutes: float) -> int:
    """Steps an epoch with which the whole schedule takes so long; places of the schedule differ in cost."""
    t, places = trainer.settings.train, 4
    trainer.train_step()
    began = time.process_time()
    for i in range(places):
        trainer.step_count = int((i + 0.5) / places * trainer.total_steps)
        trainer.train_step()
    seconds = (time.process_time() - began) / places
    return max(1, round(60.0 * core_minutes / seconds / (t.epochs + t.autoregressive_epochs)))


def scores(trainer: Trainer, count: int) -> dict[str, float]:
    cases = chosen_cases(trainer, count)
    model, trainer.stepper.model = trainer.stepper.model, trainer.ema if trainer.ema is not None else trainer.model
    result = autoregressive_scores(cache_rollout(trainer.stepper, trainer.test_cache, cases))
    trainer.stepper.model = model
    return {**result, "cases": len(cases)}


def chosen_cases(trainer: Trainer, count: int) -> np.ndarray:
    available = trainer.test_cache.case_count
    return np.unique(np.linspace(0, available - 1, min(count, available)).round().astype(int))


def train(run: Run, options, mesh, out: Path) -> dict:
    """Train one run to its end, or go on where it stopped."""
    folder = out / run.name
    folder.mkdir(parents=True, exist_ok=True)
    plan = folder / "run.json"
    if plan.exists():
        state = json.loads(plan.read_text())
        settings = settings_from_dict(state["settings"], str(plan))
    else:
        settings, state = settings_of(run, options.configs), {"curve": []}
    table = open_prior(settings.model, mesh, options.prior, options.vibration)

    def trainer() -> Trainer:
        return make_trainer(settings, options.data, mesh, table, folder, "cpu")

    if not plan.exists():
        settings.train.steps_per_epoch = measured_steps(trainer(), run.core_minutes)
        state["settings"] = settings.to_dict()
        plan.write_text(json.dumps(state))
    made = trainer()
    if (folder / "last.pt").exists():
        made.resume(folder / "last.pt")
    marks, saved, running = [made.total_steps // 2, made.total_steps], time.monotonic(), []
    while made.step_count < made.total_steps:
        running.append(made.train_step()[0])
        if made.step_count in marks:
            point = {"core_hours": made.core_seconds / 3600, "step": made.step_count}
            point |= {"train_mse_mm2": float(np.mean(running[-50:])), **scores(made, options.cases)}
            state["curve"] = [p for p in state["curve"] if p["step"] < made.step_count] + [point]
            print(f"{run.name}: {point}", flush=True)
            (folder / "run.json.tmp").write_text(json.dumps(state))
            (folder / "run.json.tmp").rename(plan)
        if made.step_count in marks or time.monotonic() - saved > SAVE_SECONDS:
            made.save("last.pt")
            saved = time.monotonic()
    references = reference_scores(made.test_cache, chosen_cases(made, options.cases))
    if settings.model.vibration:
        references[LINEAR] = references.pop("linear response, quasi-static")
    return {
        "inputs": run.inputs,
        "parameters": made.model.parameter_count(),
        "size": run.size,
        "seed": run.seed,
        "training_cases": made.train_cache.case_count,
        "core_minutes": run.core_minutes,
        "steps": made.total_steps,
        "samples": made.total_steps * settings.train.samples_per_step,
        "curve": state["curve"],
        "references": references,
    }


def runs_of(options) -> list[Run]:
    for name in options.sizes:
        if name not in SIZES:
            raise InputError(f"--sizes: {name!r} is not one of {', '.join(SIZES)}")
    combined = itertools.product(options.sizes, options.inputs, options.seeds, options.train_cases)
    return [Run(inputs, size, seed, cases, options.core_minutes) for size, inputs, seed, cases in combined]


def scaling_command(options) -> int:
    torch.set_num_threads(1)
    out, mesh = Path(options.out), find_mesh(options.mesh, options.data)
    out.mkdir(parents=True, exist_ok=True)
    bundle = read_reference(options.evaluation) if options.evaluation else None
    if options.page:  # a page without marks fails before hours of work
        replaced(options.page.read_text(), "scaling", [], options.page)
    path = out / "scaling.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    for run in [] if options.report_only else runs_of(options):
        if run.name not in results:
            results[run.name] = train(run, options, mesh, out)
            path.write_text(json.dumps(results, indent=1) + "\n")
    if not results:
        raise InputError(f"{path}: no finished run; call without --report-only")
    write_report(results, out, options.page, bundle)
    print((out / "scaling.md").read_text())
    return 0
