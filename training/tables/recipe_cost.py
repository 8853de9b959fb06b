"""What a configuration's own recipe costs and reaches in a few steps.

    python training/tables recipe_cost CONFIG --data DIR --steps 30

Trains by the configuration as it is, from the start of its schedule, and rolls a few held-out cases. CPU seconds of one
thread; the whole recipe is the steps of its epochs over these data.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import torch

from upt_training.ablate import reference_scores
from upt_training.config import load_settings
from upt_training.rollout import autoregressive_scores, cache_rollout
from upt_training.run import find_mesh, make_trainer, open_prior

COLUMNS = [
    "configuration",
    "parameters",
    "training cases",
    "steps done",
    "of",
    "CPU s a step",
    "whole recipe, days of a core",
    "training MSE, first and last tenth",
    "held-out MSE, mm² (cases)",
    "largest displacement, mm",
    "predict zero",
    "copy the true last frame",
]
KEY = 1


def marks(options: argparse.Namespace) -> str:
    return f"recipe cost {load_settings(options.config).name}"


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("config", type=Path)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--mesh", type=Path)
    parser.add_argument("--prior", type=Path)
    parser.add_argument("--vibration", type=Path)
    parser.add_argument("--steps", type=int, default=30)
    parser.add_argument("--cases", type=int, default=2)


def rows(options: argparse.Namespace) -> list[list[str]]:
    torch.set_num_threads(1)
    settings, mesh = load_settings(options.config), find_mesh(options.mesh, options.data)
    with tempfile.TemporaryDirectory() as folder:
        table = open_prior(settings.model, mesh, options.prior, options.vibration)
        trainer = make_trainer(settings, options.data, mesh, table, Path(folder), "cpu")
        began, losses = time.process_time(), []
        for step in range(options.steps):
            losses.append(trainer.train_step()[0])
            print(f"step {step + 1}: {losses[-1]:.4f} mm²", file=sys.stderr, flush=True)
        seconds = (time.process_time() - began) / options.steps
        count = min(options.cases, trainer.test_cache.case_count)
        cases = np.unique(np.linspace(0, trainer.test_cache.case_count - 1, count).round().astype(int))
        result = cache_rollout(trainer.stepper, trainer.test_cache, cases)
        scores, plain = autoregressive_scores(result), reference_scores(trainer.test_cache, cases)
    tenth = max(1, options.steps // 10)
    return [
        [
            f"`{settings.name}`",
            f"{trainer.model.parameter_count():,}",
            str(trainer.train_cache.case_count),
            str(options.steps),
            f"{trainer.total_steps:,}",
            f"{seconds:.1f}",
            f"{seconds * trainer.total_steps / 86400:.1f}",
            f"{np.mean(losses[:tenth]):.2f}, {np.mean(losses[-tenth:]):.2f}",
            f"{scores['mse_mm2']:.2f} ({len(cases)})",
            f"{result['moved'].max():.2f}",
            f"{plain['predict zero']:.2f}",
            f"{plain['copy the true last frame']:.3f}",
        ]
    ]
