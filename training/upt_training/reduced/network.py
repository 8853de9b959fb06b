"""The learned correction `b' = base(state) + s * MLP(state)`; `state` holds the inputs of docs/formats.md.

While in contact the base is the second-order term of the static response plus linear dynamics:

    g(z) = [z_i z_j] A_2                          (i <= j < n_2: quadratic in the leading response modes)
    b'   = g(z') + (z' - z) A_v + (b - g(z)) A_e + (b - b_prev) A_d

`L(c)` is the exact linearisation, so the static residual has no linear term. While free,
`b' = (b + p) A_1 + b_prev A_b + p A_p` (`p` of the step before carries the field over a release). All maps are ridge
regressions. The MLP (GELU) adds the rest; its inputs are scaled by one number a group, never per mode: whitening
amplifies the weak modes and long rollouts then diverge.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

INPUTS = ("b", "b_prev", "z", "z_prev", "p", "p_prev", "contact", "contact_prev")


class Correction(nn.Module):
    """Maps a state `[n, n_in]` to the next residual coordinates `[n, r]`, mm."""

    def __init__(self, modes: int, response_modes: int, hidden: int, depth: int = 2, quadratic_modes: int = 24) -> None:
        super().__init__()
        self.modes, self.response_modes = modes, response_modes
        self.sizes = [modes, modes, response_modes, response_modes, modes, modes, 1, 1]
        self.inputs = sum(self.sizes)
        quadratic_modes = min(quadratic_modes, response_modes)
        first, second = np.triu_indices(quadratic_modes)
        self.register_buffer("first", torch.from_numpy(first))
        self.register_buffer("second", torch.from_numpy(second))
        self.register_buffer("input_scale", torch.ones(self.inputs))
        self.register_buffer("output_scale", torch.ones(modes))
        self.register_buffer("quadratic", torch.zeros(len(first), modes))
        self.register_buffer("contact_base", torch.zeros(2 * modes + response_modes, modes))
        self.register_buffer("free_base", torch.zeros(3 * modes, modes))
        layers: list[nn.Module] = []
        width = self.inputs
        for _ in range(depth):
            layers += [nn.Linear(width, hidden), nn.GELU()]
            width = hidden
        layers.append(nn.Linear(width, modes))
        self.mlp = nn.Sequential(*layers)
        nn.init.zeros_(self.mlp[-1].weight)
        nn.init.zeros_(self.mlp[-1].bias)

    def static(self, z: Tensor) -> Tensor:
        """`g(z)`: second-order static residual, `[n, r]`."""
        return (z[:, self.first] * z[:, self.second]) @ self.quadratic

    def base(self, state: Tensor) -> Tensor:
        """The prediction without the MLP."""
        b, b_prev, z, z_prev, _, p_prev, contact, _ = state.split(self.sizes, dim=1)
        lagging = torch.cat([b - self.static(z_prev), b - b_prev, z - z_prev], dim=1)
        touching = self.static(z) + lagging @ self.contact_base
        free = torch.cat([b + p_prev, b_prev, p_prev], dim=1) @ self.free_base
        return contact * touching + (1 - contact) * free

    def forward(self, state: Tensor) -> Tensor:
        return self.base(state) + self.output_scale * self.mlp(state * self.input_scale)


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


def ridge(x: np.ndarray, y: np.ndarray, penalty: np.ndarray) -> np.ndarray:
    """`argmin |x w - y|^2 + sum_i penalty_i |w_i|^2`, float64 inside, `[n_x, n_y]` float32."""
    x, y = x.astype(np.float64), y.astype(np.float64)
    gram = x.T @ x
    size = np.trace(gram) / len(gram)
    gram[np.diag_indices(len(gram))] += penalty + 1e-9 * size + 1e-12
    return np.linalg.solve(gram, x.T @ y).astype(np.float32)


def fit_base(model: Correction, inputs: np.ndarray, targets: np.ndarray, noise: float, quadratic_ridge: float) -> None:
    """Fit the maps of the base on one-step pairs `inputs [n, n_in]`, `targets [n, r]`.

    `noise` is the assumed relative error of the state (a ridge on what multiplies it); `quadratic_ridge` is relative
    to the mean square of the quadratic features.
    """
    b, b_prev, z, z_prev, _, p_prev, contact, _ = np.split(inputs, np.cumsum(model.sizes)[:-1], axis=1)
    touching = contact[:, 0] > 0.5
    first, second = model.first.numpy(), model.second.numpy()

    def features(values: np.ndarray) -> np.ndarray:
        return values[:, first] * values[:, second]

    if touching.any():
        x, y = features(z[touching]), targets[touching]
        velocity = (z - z_prev)[touching]
        size = (x.astype(np.float64) ** 2).sum() / x.shape[1]
        speed = (velocity.astype(np.float64) ** 2).sum() / velocity.shape[1]
        penalty = np.concatenate(
            [np.full(x.shape[1], quadratic_ridge * size), np.full(velocity.shape[1], 0.01 * speed)]
        )
        static = ridge(np.concatenate([x, velocity], axis=1), y, penalty)[: x.shape[1]]
        model.quadratic.copy_(torch.from_numpy(static))
        lag = b[touching] - features(z_prev[touching]) @ static
        drift = (b - b_prev)[touching]
        error = (lag.std(0) * max(noise, 0.3)) ** 2 + 1e-9
        penalty = len(lag) * np.concatenate([error, error, np.full(velocity.shape[1], 0.01 * speed / len(lag))])
        x = np.concatenate([lag, drift, velocity], axis=1)
        model.contact_base.copy_(torch.from_numpy(ridge(x, y - features(z[touching]) @ static, penalty)))
    if (~touching).any():
        free = ~touching
        x = np.concatenate([b[free] + p_prev[free], b_prev[free], p_prev[free]], axis=1)
        deviation = targets.std(0) * 2 * noise
        penalty = len(x) * np.concatenate([deviation**2, deviation**2, (2 * deviation) ** 2 + 1e-9])
        model.free_base.copy_(torch.from_numpy(ridge(x, targets[free], penalty)))
