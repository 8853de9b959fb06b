"""The learned correction `b' = base(state) + s * MLP(state)`; `state` holds the inputs of docs/reference/formats.md.

While in contact the base is the static residual plus linear dynamics:

    g(z) = [z_i z_j] A_2 + s |z|² / (|z|² + q) N(z)   (i <= j < n_2: quadratic in the leading response modes)
    b'   = g(z') + (z' - z) A_v + (b - g(z)) A_e + (b - b_prev) A_d

`L(c)` is the exact linearisation, so the static residual has no linear term. `N` is a network of `z` alone, fitted to
static equilibria (none without them); the factor before it leaves it of second order at rest. While free,
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

    def __init__(
        self,
        modes: int,
        response_modes: int,
        hidden: int,
        depth: int = 2,
        quadratic_modes: int = 24,
        static_hidden: int = 0,
    ) -> None:
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
        self.mlp = perceptron(self.inputs, hidden, depth, modes)
        self.static_mlp = perceptron(response_modes, static_hidden, 2, modes) if static_hidden else None
        self.register_buffer("static_input_scale", torch.tensor(1.0))
        self.register_buffer("static_output_scale", torch.ones(modes))
        self.register_buffer("static_square", torch.tensor(1.0))

    def static_network(self, z: Tensor) -> Tensor:
        """`s |z|² / (|z|² + q) N(z)`, `[n, r]`; needs static training."""
        square = (z * z).sum(1, keepdim=True)
        share = square / (square + self.static_square)
        return share * self.static_output_scale * self.static_mlp(z * self.static_input_scale)

    def static(self, z: Tensor) -> Tensor:
        """`g(z)`: static residual, `[n, r]`."""
        quadratic = (z[:, self.first] * z[:, self.second]) @ self.quadratic
        return quadratic if self.static_mlp is None else quadratic + self.static_network(z)

    def base(self, state: Tensor) -> Tensor:
        """The prediction without the MLP."""
        b, b_prev, z, z_prev, _, p_prev, contact, _ = state.split(self.sizes, dim=1)
        lagging = torch.cat([b - self.static(z_prev), b - b_prev, z - z_prev], dim=1)
        touching = self.static(z) + lagging @ self.contact_base
        free = torch.cat([b + p_prev, b_prev, p_prev], dim=1) @ self.free_base
        return contact * touching + (1 - contact) * free

    def forward(self, state: Tensor) -> Tensor:
        return self.base(state) + self.output_scale * self.mlp(state * self.input_scale)


def perceptron(inputs: int, hidden: int, depth: int, outputs: int) -> nn.Sequential:
    """GELU layers; the last one starts at zero."""
    layers: list[nn.Module] = []
    width = inputs
    for _ in range(depth):
        layers += [nn.Linear(width, hidden), nn.GELU()]
        width = hidden
    layers.append(nn.Linear(width, outputs))
    nn.init.zeros_(layers[-1].weight)
    nn.init.zeros_(layers[-1].bias)
    return nn.Sequential(*layers)


def bound(
    b: Tensor, limit: Tensor, response_norm: Tensor, jump: Tensor, changed: Tensor, relative: float, decay: float
) -> tuple[Tensor, Tensor]:
    """Stability (docs/reference/formats.md): `E' = max(relative |L'|, decay (E + changed |L' - L|))`, `|b| <= E'`."""
    grown = torch.maximum(relative * response_norm, decay * (limit + changed * jump))
    norm = torch.linalg.vector_norm(b, dim=1)
    return b * torch.clamp(grown / norm.clamp_min(1e-12), max=1.0).unsqueeze(1), grown


def fade(push: Tensor, start: float, end: float) -> Tensor:
    """Share of the correction that is kept for a largest push, 1 below `start` and 0 above `end` (mm)."""
    return torch.clamp((end - push) / (end - start), 0.0, 1.0)
