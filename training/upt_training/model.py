"""The surrogate M: (u^t, c^{t+Δt}) -> u^{t+Δt}: a Universal Physics Transformer (paper, "Deep learning architecture").

concat(features) -> Linear + sincos -> mean message passing onto supernodes -> transformer -> perceiver pooling ->
approximator -> perceiver decoder. Message Linears stay factored (docs/reference/formats.md, graphs of a upt bundle):
`W1 [x_j ; x_i] + b1 = (W1s x_j) + (W1t x_i + b1)`, exact, so that only add, GELU and mean are done per edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

from upt_training.config import FEATURE_WIDTH, ModelSettings
from upt_training.errors import InputError
from upt_training.layers import Block, Decoder, PerceiverPool, sincos

START_STD = 0.02
RELATIVE_SCALE = 0.1  # model coordinates reach 200, a neighbour lies some tens away


@dataclass
class Tables:
    """What depends on the mesh alone. `nodes` are the needed nodes; neighbour indices count within them."""

    nodes: torch.Tensor  # [n] mesh node of each needed node
    source: torch.Tensor  # [n, d]
    target: torch.Tensor  # [n_S, d]
    query: torch.Tensor  # [m, 2h], rows as asked for


class Upt(nn.Module):
    """Weights of the network. Input features are normalised; `forward` returns mm, before `base` is added."""

    def __init__(self, settings: ModelSettings):
        super().__init__()
        self.settings = settings
        self.padded = False  # messages over padded rows in place of the edges that there are
        d = settings.encoder
        self.embed = nn.Linear(settings.feature_count, d)
        self.message1 = nn.Linear(2 * d, d)
        self.message2 = nn.Linear(d, d)
        self.relative = nn.Linear(3, d, bias=False) if settings.relative_positions else None
        self.encoder = nn.ModuleList(
            Block(d, settings.encoder_heads, settings.mlp_ratio, settings.drop_path)
            for _ in range(settings.encoder_depth)
        )
        self.pool = PerceiverPool(settings.latent_tokens, settings.latent, d, settings.latent_heads, settings.mlp_ratio)
        self.approximator = nn.ModuleList(
            Block(settings.latent, settings.latent_heads, settings.mlp_ratio, settings.drop_path)
            for _ in range(settings.approximator_depth)
        )
        self.decoder = Decoder(settings.decoder, settings.decoder_heads, settings.decoder_mlp_ratio, settings.latent)
        self.register_buffer("feature_mean", torch.zeros(3))
        self.register_buffer("feature_std", torch.ones(3))
        self.register_buffer("coordinate_offset", torch.zeros(3))
        self.register_buffer("coordinate_scale", torch.ones(()))
        self.register_buffer("output_scale", torch.ones(3))
        self.register_buffer("mixing", torch.eye(settings.feature_count))
        self.apply(_initialise)

    # -- set-up -------------------------------------------------------------------------------------------------

    def set_normalisation(self, mean, std, output_scale, mixing_scale: float = 1.0) -> None:
        """Per-axis mean and std of `u` in mm; `output_scale` in mm; `mixing_scale` widens the differences."""
        self.feature_mean.copy_(torch.as_tensor(mean, dtype=torch.float32))
        self.feature_std.copy_(torch.as_tensor(std, dtype=torch.float32))
        self.output_scale.copy_(torch.as_tensor(output_scale, dtype=torch.float32))
        if self.settings.mixing == "differences":
            self.mixing.copy_(difference_mixing(self.settings.features, mixing_scale))

    def set_coordinates(self, positions) -> None:
        """Map the mesh's bounding box into [0, 200]³ with one scale for all axes."""
        low, high = positions.min(axis=0), positions.max(axis=0)
        self.coordinate_offset.copy_(torch.as_tensor(low, dtype=torch.float32))
        self.coordinate_scale.fill_(float(200.0 / (high - low).max()))

    def scale_start(self) -> None:
        """Widen fresh Linear weights from std 0.02 to one over the root of the number of inputs.

        With 0.02 a layer of width 48 passes on a seventh of its input: small networks then stand still for long.
        """
        with torch.no_grad():
            for module in self.modules():
                if isinstance(module, nn.Linear):
                    module.weight.mul_(module.in_features**-0.5 / START_STD)

    def parameter_count(self) -> int:
        return sum(p.numel() for p in self.parameters())

    # -- the parts ----------------------------------------------------------------------------------------------

    def coordinates(self, positions: torch.Tensor) -> torch.Tensor:
        return (positions - self.coordinate_offset) * self.coordinate_scale

    def normalise(self, fields: dict[str, torch.Tensor]) -> torch.Tensor:
        """Named node fields (mm; `contact` 0 or 1, `[..., n, 1]`) -> features `[..., n, f]` in the bundle's order."""
        parts = []
        for name in self.settings.features:
            value = fields[name]
            parts.append(value if FEATURE_WIDTH[name] == 1 else (value - self.feature_mean) / self.feature_std)
        return torch.cat(parts, dim=-1)

    def encoder_weights(self) -> tuple[torch.Tensor, torch.Tensor]:
        """`encoder.source [d, f]`, `encoder.target [d, f]`: message and input Linear multiplied out."""
        d = self.settings.encoder
        w_in = self.embed.weight @ self.mixing
        return self.message1.weight[:, :d] @ w_in, self.message1.weight[:, d:] @ w_in

    def tables(self, positions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Positions `[n, 3]` mm -> source table `[n, d]`, target table `[n, d]`, query table `[n, 2h]`."""
        d = self.settings.encoder
        p = self.coordinates(positions)
        x = self.embed.bias + sincos(p, d)
        source = x @ self.message1.weight[:, :d].T
        target = x @ self.message1.weight[:, d:].T + self.message1.bias
        if self.relative is not None:
            place = self.relative(RELATIVE_SCALE * p)
            source, target = source + place, target - place
        return source, target, self.decoder.queries(sincos(p, self.settings.decoder))

    def aggregate(self, source, target, neighbours, mask) -> torch.Tensor:
        """Mean over a row of `GELU(source_j + target_i)`: `[..., n, d]`, `[..., n_S, d]` -> `[..., n_S, d]`.

        Computed on the edges that there are: on coarse meshes half of the padded rows is padding. With `padded` over
        the rows as they are, whose shape does not depend on what was drawn.
        """
        if self.padded:
            sent = source.index_select(-2, neighbours.flatten()).unflatten(-2, neighbours.shape)
            edge = functional.gelu(sent + target[..., :, None, :])
            return (edge * mask[..., None]).sum(-2) / mask.sum(-1, keepdim=True)
        receivers, column = mask.nonzero(as_tuple=True)
        senders = neighbours[receivers, column]
        edge = functional.gelu(source.index_select(-2, senders) + target.index_select(-2, receivers))
        total = torch.zeros_like(target).index_add(-2, receivers, edge)
        return total / mask.sum(-1, keepdim=True)

    def latent(self, supernodes: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Aggregated supernodes `[..., n_S, d]` -> decoder keys and values `[..., L, h]`."""
        x = self.message2(supernodes)
        for block in self.encoder:
            x = block(x)
        z = self.pool(x)
        for block in self.approximator:
            z = block(z)
        return self.decoder.keys_values(z)

    def decode(self, query, k, v) -> torch.Tensor:
        """Query table rows -> `[..., n, 3]` mm, before `base`."""
        return self.decoder(query, k, v) * self.output_scale

    # -- the whole ----------------------------------------------------------------------------------------------

    def forward(self, features, tables, neighbours, mask, supernodes, query, scored=None) -> torch.Tensor:
        """Features `[..., n, f]` of the table's nodes -> `[..., m, 3]` mm for the rows of `query`.

        `tables` = (source `[n, d]`, target `[n, d]`); `neighbours [n_S, degree]` and `supernodes [n_S]` index `n`.
        `scored` (training only): rows of `query` through which gradients flow, the rows that are decoded without (what
        the next step reads), and the samples of the batch for which they are; all other rows stay zero.
        """
        with torch.autocast(features.device.type, enabled=False):  # differences of the features need float32
            w_source, w_target = self.encoder_weights()
            source = features @ w_source.T + tables[0]
            target = features.index_select(-2, supernodes) @ w_target.T + tables[1].index_select(0, supernodes)
        k, v = self.latent(self.aggregate(source, target, neighbours, mask))
        if scored is None:
            return self.decode(query, k, v)
        rows, read, readers = scored
        out = torch.zeros(*k.shape[:-2], len(query), 3, device=k.device)
        if len(readers) > 0:
            with torch.no_grad():
                out[readers[:, None], read] = self.decode(query[read], k[readers], v[readers]).float()
        return out.index_copy(-2, rows, self.decode(query.index_select(0, rows), k, v).float())

    def forward_unfactored(self, features, positions, neighbours, mask, supernodes) -> torch.Tensor:
        """The paper's layout, edge by edge, all nodes decoded; for the export's self-check."""
        x = self.embed(features @ self.mixing.T) + sincos(self.coordinates(positions), self.settings.encoder)
        xi = x[supernodes][:, None, :].expand(-1, neighbours.shape[1], -1)
        edge = self.message1(torch.cat([x[neighbours], xi], dim=-1))
        if self.relative is not None:
            p = RELATIVE_SCALE * self.coordinates(positions)
            edge = edge + self.relative(p[neighbours] - p[supernodes][:, None, :])
        message = self.message2(functional.gelu(edge))
        s = (message * mask[..., None]).sum(-2) / mask.sum(-1, keepdim=True)
        for block in self.encoder:
            s = block(s)
        z = self.pool(s)
        for block in self.approximator:
            z = block(z)
        k, v = self.decoder.keys_values(z)
        query = self.decoder.queries(sincos(self.coordinates(positions), self.settings.decoder))
        return self.decode(query, k, v)


def difference_mixing(features: list[str], scale: float) -> torch.Tensor:
    """A fixed linear map of the features, merged into the first Linear at export.

    The residual state `u - L(c^t)`, the velocity `u^t - u^{t-1}` and the change of the response `L' - L` are small
    beside `u` and `L`; given as they are the network would have to find them as differences of large numbers.
    """
    width = sum(FEATURE_WIDTH[name] for name in features)
    start, at = {}, 0
    for name in features:
        start[name] = at
        at += FEATURE_WIDTH[name]
    mix = torch.eye(width)
    pairs = (
        ("displacement", "previous_prior"),
        ("previous_displacement", "displacement"),
        ("previous_prior", "prior"),
    )
    for minuend, subtrahend in pairs:
        if minuend not in start or subtrahend not in start:
            continue
        for axis in range(3):
            mix[start[minuend] + axis, start[minuend] + axis] = scale
            mix[start[minuend] + axis, start[subtrahend] + axis] = -scale
    return mix


def _initialise(module: nn.Module) -> None:
    if isinstance(module, nn.Linear):
        nn.init.trunc_normal_(module.weight, std=START_STD)
        if module.bias is not None:
            nn.init.zeros_(module.bias)


def load_state(model: Upt, state: dict, where: str) -> None:
    """Load weights; a state of another configuration is an `InputError`."""
    own = model.state_dict()
    for name, value in own.items():
        if name not in state:
            raise InputError(f"{where}: weight {name!r} is missing; the checkpoint is of another configuration")
        if tuple(state[name].shape) != tuple(value.shape):
            raise InputError(
                f"{where}: weight {name!r} has shape {tuple(state[name].shape)}, the configuration asks for "
                f"{tuple(value.shape)}; use the configuration the checkpoint was made with"
            )
    model.load_state_dict({k: state[k] for k in own})
