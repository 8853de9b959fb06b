"""Training of the correction: ridge base, then rollouts with noise on the state and back-propagation through time."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from upt_training.loads import TOOL, TRAINED, WITHHELD
from upt_training.reduced.base import Equilibria, fit_base
from upt_training.reduced.network import Correction
from upt_training.reduced.rollout import (
    Drive,
    Limits,
    drive_of,
    field_mse,
    release_frames,
    rollout,
    rollout_from_rest,
    true_limits,
    windows,
)
from upt_training.reduced.states import States
from upt_training.reduced.statics import Statics


@dataclass
class Settings:
    """`stages` are `(steps of a rollout, batch, share of the updates)`."""

    hidden: int = 256
    depth: int = 2
    updates: int = 800
    stages: list[tuple[int, int, float]] = field(default_factory=lambda: [(8, 96, 0.4), (24, 48, 0.6)])
    learning_rate: float = 1e-3
    weight_decay: float = 0.02
    noise: float = 0.03
    quadratic_modes: int = 24
    quadratic_ridge: float = 1e-2
    static_hidden: int = 0
    static_updates: int = 3000
    static_weight: float = 8.0
    ema: float = 0.998
    seed: int = 1
    validate_every: int = 100


def state_pairs(states: States) -> tuple[np.ndarray, np.ndarray]:
    """One-step inputs `[n, n_in]` and targets `[n, r]` along the true trajectories."""
    b, z, p = states.b, states.z, states.p
    before = np.concatenate([np.zeros_like(b[:, :1]), b[:, :-2]], axis=1)
    flags = states.contact.astype(np.float32)[..., None]
    inputs = np.concatenate(
        [b[:, :-1], before, z[:, 1:], z[:, :-1], p[:, 1:], p[:, :-1], flags[:, 1:], flags[:, :-1]], axis=2
    )
    valid = states.valid[:, 1:]
    return inputs[valid], b[:, 1:][valid]


def prepare(states: States, settings: Settings, statics: Statics | None = None) -> Correction:
    """A model with its scales and its base fitted to `states` and equilibria; the MLP adds nothing yet."""
    torch.manual_seed(settings.seed)
    static_hidden = settings.static_hidden if statics is not None else 0
    model = Correction(
        states.modes, states.z.shape[2], settings.hidden, settings.depth, settings.quadratic_modes, static_hidden
    )
    inputs, targets = state_pairs(states)
    frames = states.length.sum()
    rms = {name: math.sqrt(float((getattr(states, name) ** 2).sum() / frames)) + 1e-9 for name in ("b", "z", "p")}
    r, rz = states.modes, states.z.shape[2]
    groups = [(2 * r, rms["b"]), (2 * rz, rms["z"]), (2 * r, rms["p"])]
    spread = math.sqrt(32.0)
    scale = np.concatenate([np.full(count, spread / value) for count, value in groups] + [np.ones(2)])
    # The MLP sees the leading response modes only: sites are few, and p repeats what z says.
    for start in (2 * r, 2 * r + rz):
        scale[start + settings.quadratic_modes : start + rz] = 0.0
    scale[2 * r + 2 * rz : -2] = 0.0
    model.input_scale.copy_(torch.from_numpy(scale.astype(np.float32)))
    equilibria = Equilibria(statics, settings.static_weight, settings.static_updates) if statics is not None else None
    fit_base(model, inputs, targets, settings.noise, settings.quadratic_ridge, equilibria)
    with torch.no_grad():
        error = targets - model(torch.from_numpy(inputs)).numpy()
    output = error.std(0) + 1e-3 * error.std()
    model.output_scale.copy_(torch.from_numpy(output.astype(np.float32)))
    return model


def holds(statics: Statics, rows: np.ndarray, steps: int, limits: Limits) -> tuple[Drive, torch.Tensor, torch.Tensor]:
    """Equilibria held for `steps`: what the host imposes, the state `[n, r]` and the bound there `[n]`."""

    def repeated(values: np.ndarray) -> torch.Tensor:
        out = torch.from_numpy(np.ascontiguousarray(values[rows], np.float32)).unsqueeze(1)
        return out.expand(-1, steps + 1, *out.shape[2:])

    norm = repeated(statics.response_norm)
    drive = Drive(
        z=repeated(statics.z),
        p=repeated(statics.p),
        contact=torch.ones_like(norm),
        changed=torch.zeros_like(norm),
        push=repeated(statics.push),
        response_norm=norm,
        response_jump=torch.zeros_like(norm),
    )
    return drive, torch.from_numpy(np.float32(statics.b[rows])), limits.relative * norm[:, 0]


def summary(states: States, b: np.ndarray) -> dict[str, float]:
    """Mean squared errors of full rollouts, mm²: all cases, schemes 1-4, scheme 5, tools, after abrupt release."""
    mse = field_mse(states, b)
    by_case = np.where(states.valid, mse, 0.0)[:, 2:].sum(1) / (states.length - 2)
    out = {"mse": float(by_case.mean())}
    masks = {
        "schemes_1_4": np.isin(states.scheme, TRAINED),
        "scheme_5": states.scheme == WITHHELD,
        "tools": np.char.startswith(states.scheme.astype(str), TOOL),
    }
    for name, mask in masks.items():
        if mask.any():
            out[name] = float(by_case[mask].mean())
    released = release_frames(states)
    if released.any():
        out["after_release"] = float(mse[released].mean())
    return out


def train(
    states: States,
    validation: States,
    limits: Limits,
    settings: Settings,
    report: Callable[[str], None] = print,
    checkpoint: Path | None = None,
    statics: Statics | None = None,
) -> tuple[Correction, dict]:
    """Train on `states` and held equilibria, half a batch of these to one of motion.

    The model returned is the EMA copy with the smallest validation error over full rollouts.
    """
    model = prepare(states, settings, statics)
    base = summary(validation, rollout_from_rest(model, validation, limits))
    report("ridge base alone: " + ", ".join(f"{k} {v:.5f}" for k, v in base.items()))
    average = copy.deepcopy(model)
    best, best_error = copy.deepcopy(model), base["mse"]
    if not math.isfinite(best_error):
        best_error = math.inf
    rng = np.random.default_rng(settings.seed)
    drive, true_b = drive_of(states), torch.from_numpy(states.b)
    limit = torch.from_numpy(true_limits(states, limits))
    deviation = torch.from_numpy(states.b[states.valid].std(0))
    optimiser = torch.optim.AdamW(model.mlp.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)
    done, started, history, running = 0, time.monotonic(), [], []
    first = 0
    if checkpoint and checkpoint.exists():
        saved = torch.load(checkpoint, weights_only=True)
        model.load_state_dict(saved["model"])
        average.load_state_dict(saved["average"])
        best.load_state_dict(saved["best"])
        optimiser.load_state_dict(saved["optimiser"])
        first, best_error, history = saved["update"], saved["best_error"], saved["history"]
        rng = np.random.default_rng([settings.seed, first])
        report(f"resumed at update {first}")
    for steps, batch, share in settings.stages:
        for _ in range(round(share * settings.updates)):
            done += 1
            if done <= first:
                continue
            cosine = 0.5 * (1 + math.cos(math.pi * done / (settings.updates + 1)))
            rate = settings.learning_rate * min(1.0, done / 100) * cosine
            for group in optimiser.param_groups:
                group["lr"] = rate
            drawn = rng.choice(np.flatnonzero(states.length > steps), batch)
            cases = torch.from_numpy(drawn)
            starts = torch.from_numpy(rng.integers(states.length[drawn] - steps))
            pieces = Drive(**{k: windows(v, cases, starts, steps + 1) for k, v in vars(drive).items()})
            target = windows(true_b, cases, starts, steps + 1)
            b, bounds = target[:, 0], limit[cases, starts]
            b_prev = true_b[cases, (starts - 1).clamp_min(0)]
            if statics is not None:
                held, rest, rest_bounds = holds(statics, rng.integers(statics.count, size=batch // 2), steps, limits)
                pieces = Drive(**{k: torch.cat([v, getattr(held, k)]) for k, v in vars(pieces).items()})
                target = torch.cat([target, rest.unsqueeze(1).expand(-1, steps + 1, -1)])
                b, b_prev, bounds = torch.cat([b, rest]), torch.cat([b_prev, rest]), torch.cat([bounds, rest_bounds])
            common = torch.randn_like(b) * deviation * settings.noise
            b = b + common + 0.5 * torch.randn_like(b) * deviation * settings.noise
            b_prev = b_prev + common
            model.train()
            found = rollout(model, pieces, b, b_prev, bounds, limits)
            loss = ((found - target[:, 1:]) ** 2).sum(2).mean() / float(states.nodes)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(model.mlp.parameters(), 1.0)
            optimiser.step()
            running.append(loss.item())
            decay = min(settings.ema, (done + 1) / (done + 10))
            with torch.no_grad():
                for kept, current in zip(average.mlp.parameters(), model.mlp.parameters(), strict=True):
                    kept.lerp_(current, 1 - decay)
            if done % settings.validate_every == 0 or done == settings.updates:
                now = summary(validation, rollout_from_rest(average, validation, limits))
                history.append({"update": done, "steps": steps, "loss": float(np.mean(running)), **now})
                if now["mse"] < best_error:
                    best_error = now["mse"]
                    best.load_state_dict(average.state_dict())
                left = (time.monotonic() - started) / max(done - first, 1) * (settings.updates - done)
                text = ", ".join(f"{k} {v:.5f}" for k, v in now.items())
                place = f"update {done}/{settings.updates} ({steps} steps)"
                report(f"{place}: loss {np.mean(running):.5f}, {text}, {left:.0f} s left")
                running = []
                if checkpoint:
                    saved = {
                        "model": model.state_dict(),
                        "average": average.state_dict(),
                        "best": best.state_dict(),
                        "optimiser": optimiser.state_dict(),
                        "update": done,
                        "best_error": best_error,
                        "history": history,
                    }
                    torch.save(saved, checkpoint.with_suffix(".partial"))
                    checkpoint.with_suffix(".partial").rename(checkpoint)
    return best, {"base": base, "history": history, "validation_mse": best_error}
