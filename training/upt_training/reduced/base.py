"""Fits the base of the correction: ridge regressions, and the network of the static residual."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np
import torch

from upt_training.reduced.network import Correction
from upt_training.reduced.statics import Statics


@dataclass
class Equilibria:
    """Equilibria to fit; each counts as `weight` frames, the network of the static residual takes `updates` steps."""

    samples: Statics
    weight: float
    updates: int


def ridge(x: np.ndarray, y: np.ndarray, penalty: np.ndarray) -> np.ndarray:
    """`argmin |x w - y|^2 + sum_i penalty_i |w_i|^2`, float64 inside, `[n_x, n_y]` float32."""
    x, y = x.astype(np.float64), y.astype(np.float64)
    gram = x.T @ x
    size = np.trace(gram) / len(gram)
    gram[np.diag_indices(len(gram))] += penalty + 1e-9 * size + 1e-12
    return np.linalg.solve(gram, x.T @ y).astype(np.float32)


def fit_base(
    model: Correction,
    inputs: np.ndarray,
    targets: np.ndarray,
    noise: float,
    quadratic_ridge: float,
    equilibria: Equilibria | None = None,
) -> None:
    """Fit the maps of the base on one-step pairs `inputs [n, n_in]`, `targets [n, r]`, and on equilibria.

    `noise` is the assumed relative error of the state (a ridge on what multiplies it); `quadratic_ridge` is relative
    to the mean square of the quadratic features.
    """
    b, b_prev, z, z_prev, _, p_prev, contact, _ = np.split(inputs, np.cumsum(model.sizes)[:-1], axis=1)
    touching = contact[:, 0] > 0.5
    first, second = model.first.numpy(), model.second.numpy()

    def features(values: np.ndarray) -> np.ndarray:
        return values[:, first] * values[:, second]

    def static(values: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return model.static(torch.from_numpy(np.ascontiguousarray(values, np.float32))).numpy()

    if touching.any():
        x, y = features(z[touching]), targets[touching]
        velocity = (z - z_prev)[touching]
        moving = velocity
        if equilibria is not None:
            statics, root = equilibria.samples, math.sqrt(equilibria.weight)
            x = np.concatenate([x, root * features(statics.z)])
            y = np.concatenate([y, root * statics.b])
            moving = np.concatenate([velocity, np.zeros((statics.count, velocity.shape[1]), velocity.dtype)])
        size = (x.astype(np.float64) ** 2).sum() / x.shape[1]
        speed = (velocity.astype(np.float64) ** 2).sum() / velocity.shape[1]
        penalty = np.concatenate(
            [np.full(x.shape[1], quadratic_ridge * size), np.full(velocity.shape[1], 0.01 * speed)]
        )
        quadratic = ridge(np.concatenate([x, moving], axis=1), y, penalty)[: x.shape[1]]
        model.quadratic.copy_(torch.from_numpy(quadratic))
        if equilibria is not None and model.static_mlp is not None:
            fit_static_network(model, equilibria)
        lag = b[touching] - static(z_prev[touching])
        drift = (b - b_prev)[touching]
        error = (lag.std(0) * max(noise, 0.3)) ** 2 + 1e-9
        penalty = len(lag) * np.concatenate([error, error, np.full(velocity.shape[1], 0.01 * speed / len(lag))])
        x = np.concatenate([lag, drift, velocity], axis=1)
        residual = targets[touching] - static(z[touching])
        model.contact_base.copy_(torch.from_numpy(ridge(x, residual, penalty)))
    if (~touching).any():
        free = ~touching
        x = np.concatenate([b[free] + p_prev[free], b_prev[free], p_prev[free]], axis=1)
        deviation = targets.std(0) * 2 * noise
        penalty = len(x) * np.concatenate([deviation**2, deviation**2, (2 * deviation) ** 2 + 1e-9])
        model.free_base.copy_(torch.from_numpy(ridge(x, targets[free], penalty)))


def fit_static_network(model: Correction, equilibria: Equilibria, batch: int = 256, weight_decay: float = 0.02) -> None:
    """Fit `N` to what the quadratic map leaves of the equilibria (AdamW, cosine, average of the weights)."""
    statics, updates = equilibria.samples, equilibria.updates
    z, b = torch.from_numpy(np.float32(statics.z)), torch.from_numpy(np.float32(statics.b))
    square = (z * z).sum(1).mean()
    model.static_square.copy_(0.02 * square)
    model.static_input_scale.copy_(math.sqrt(32.0) / square.sqrt())
    with torch.no_grad():
        left = b - (z[:, model.first] * z[:, model.second]) @ model.quadratic
    model.static_output_scale.copy_(left.std(0) + 1e-3 * left.std())
    # Depths differ by orders of magnitude in the residual: an error counts relative to the push.
    weight = 1.0 / ((z * z).sum(1) + 0.2 * square)
    weight = weight / weight.mean()
    network = model.static_mlp
    average = copy.deepcopy(network)
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-3, weight_decay=weight_decay)
    generator = torch.Generator().manual_seed(1)
    for update in range(updates):
        rate = 1e-3 * min(1.0, (update + 1) / 100) * 0.5 * (1 + math.cos(math.pi * update / updates))
        for group in optimiser.param_groups:
            group["lr"] = rate
        rows = torch.randint(len(z), (batch,), generator=generator)
        error = model.static_network(z[rows]) - left[rows]
        loss = (weight[rows] * (error * error).sum(1)).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        decay = min(0.998, (update + 1) / (update + 10))
        with torch.no_grad():
            for kept, current in zip(average.parameters(), network.parameters(), strict=True):
                kept.lerp_(current, 1 - decay)
    network.load_state_dict(average.state_dict())
