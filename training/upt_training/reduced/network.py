"""The learned correction: `b' = base + s * MLP(state)`, with `state` the concatenated inputs of docs/formats.md.

`base` is linear in the state and fitted by ridge regression, one map while in contact and one while free; the MLP
(GELU) adds what is nonlinear. Inputs are scaled by one number a group (b, z, p), never per mode: whitening amplifies
the weak modes and long rollouts then diverge.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

INPUTS = ("b", "b_prev", "z", "z_prev", "p", "p_prev", "contact", "contact_prev")


class Correction(nn.Module):
    """Maps a state `[n, n_in]` to the next residual coordinates `[n, r]`, mm."""

    def __init__(self, modes: int, response_modes: int, hidden: int, depth: int = 2) -> None:
        super().__init__()
        self.modes, self.response_modes = modes, response_modes
        self.sizes = [modes, modes, response_modes, response_modes, modes, modes, 1, 1]
        self.inputs = sum(self.sizes)
        free = 3 * modes + response_modes
        self.register_buffer("input_scale", torch.ones(self.inputs))
        self.register_buffer("output_scale", torch.ones(modes))
        self.register_buffer("contact_base", torch.zeros(self.inputs - 2, modes))
        self.register_buffer("free_base", torch.zeros(free, modes))
        layers: list[nn.Module] = []
        width = self.inputs
        for _ in range(depth):
            layers += [nn.Linear(width, hidden), nn.GELU()]
            width = hidden
        layers.append(nn.Linear(width, modes))
        self.mlp = nn.Sequential(*layers)
        nn.init.zeros_(self.mlp[-1].weight)
        nn.init.zeros_(self.mlp[-1].bias)

    def forward(self, state: Tensor) -> Tensor:
        r, rz = self.modes, self.response_modes
        contact = state[:, -2:-1]
        states, z_prev, p_prev = state[:, : 2 * r], state[:, 2 * r + rz : 2 * r + 2 * rz], state[:, 3 * r + 2 * rz : -2]
        free_inputs = torch.cat([states, z_prev, p_prev], dim=1)
        linear = contact * (state[:, :-2] @ self.contact_base) + (1 - contact) * (free_inputs @ self.free_base)
        return linear + self.output_scale * self.mlp(state * self.input_scale)


def bound(
    b: Tensor, limit: Tensor, response_norm: Tensor, jump: Tensor, changed: Tensor, relative: float, decay: float
) -> tuple[Tensor, Tensor]:
    """The stability bound of docs/formats.md: `E' = max(relative |L'|, decay (E + changed |L' - L|))`, `|b| <= E'`."""
    grown = torch.maximum(relative * response_norm, decay * (limit + changed * jump))
    norm = torch.linalg.vector_norm(b, dim=1)
    return b * torch.clamp(grown / norm.clamp_min(1e-12), max=1.0).unsqueeze(1), grown


def fade(push: Tensor, start: float, end: float) -> Tensor:
    """Share of the correction that is kept for a largest push, 1 below `start` and 0 above `end` (mm)."""
    return torch.clamp((end - push) / (end - start), 0.0, 1.0)


def ridge_base(model: Correction, inputs: np.ndarray, targets: np.ndarray, noise: np.ndarray, ridge: float) -> None:
    """Fit both linear maps on one-step pairs; `noise [n_in]`, a standard deviation for each input, acts as a ridge."""
    r, rz = model.modes, model.response_modes
    touching = inputs[:, -2] > 0.5
    free_columns = np.r_[0 : 2 * r, 2 * r + rz : 2 * r + 2 * rz, 3 * r + 2 * rz : 4 * r + 2 * rz]
    for mask, columns, target in (
        (touching, np.arange(model.inputs - 2), model.contact_base),
        (~touching, free_columns, model.free_base),
    ):
        x, y = inputs[mask][:, columns].astype(np.float64), targets[mask].astype(np.float64)
        if not len(x):
            continue
        gram = x.T @ x
        size = np.trace(gram) / len(gram)
        gram += np.diag(len(x) * noise[columns] ** 2 + ridge * size)
        target.copy_(torch.from_numpy(np.linalg.solve(gram, x.T @ y).astype(np.float32)))
