"""One step of the recurrence on a node subset, batched, differentiable: features, network, base, boundary conditions.

`u' = base + network(features)`, with `base` 0, `u` or `L(c')`; then held nodes are 0 and contact nodes `c'` when the
boundary is enforced. All fields `[B, n, 3]` in mm on the subset's nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

from upt_training.graph import Graph
from upt_training.mesh_file import Mesh
from upt_training.model import Upt


class Encoded(NamedTuple):
    """Supernodes that a prediction is encoded with, all or some; indices count within the subset's nodes."""

    neighbours: torch.Tensor  # [n_S, degree]
    mask: torch.Tensor  # [n_S, degree]
    supernodes: torch.Tensor  # [n_S]
    read: torch.Tensor  # [r] nodes whose features are read: senders and supernodes


@dataclass
class State:
    """Displacement of this and the previous frame, and the prior's response of this frame."""

    u: torch.Tensor
    previous: torch.Tensor
    prior: torch.Tensor | None

    def detach(self) -> State:
        return State(self.u.detach(), self.previous.detach(), self.prior)

    def part(self, samples: np.ndarray) -> State:
        """Some samples of the batch."""
        if len(samples) == len(self.u):
            return self
        return State(self.u[samples], self.previous[samples], None if self.prior is None else self.prior[samples])

    def among(self, samples: np.ndarray, batch: int) -> State:
        """These samples at their places in a batch whose other samples are zero."""
        at = torch.from_numpy(samples).to(self.u.device)

        def spread(x: torch.Tensor) -> torch.Tensor:
            return torch.zeros(batch, *x.shape[1:], dtype=x.dtype, device=x.device).index_copy(0, at, x)

        return State(spread(self.u), spread(self.previous), None if self.prior is None else spread(self.prior))


class Stepper:
    """Static data of a subset: `nodes` must hold every node the graph reads."""

    def __init__(
        self,
        model: Upt,
        mesh: Mesh,
        graph: Graph,
        nodes: np.ndarray,
        boundary: str,
        exact: bool,
        device="cpu",
    ):
        place = np.full(mesh.node_count, -1)
        place[nodes] = np.arange(len(nodes))
        neighbours, mask = graph.padded()
        neighbours = place[neighbours] * (mask > 0)
        assert (neighbours >= 0).all() and (place[graph.supernodes] >= 0).all()
        held = np.zeros(mesh.node_count, bool)
        held[mesh.held_nodes(boundary)] = True
        self.model, self.exact, self.device = model, exact, torch.device(device)
        to = self.device
        parts = (neighbours, mask, place[graph.supernodes], place[graph.needed_nodes()])
        self.all = Encoded(*(torch.from_numpy(part).to(to) for part in parts))
        self.positions = torch.from_numpy(mesh.positions[nodes].astype(np.float32)).to(to)
        self.free = torch.from_numpy(~held[nodes]).to(to, torch.float32)[:, None]
        self.node_count = len(nodes)

    def tables(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        return self.model.tables(self.positions)

    def rest(self, batch: int) -> State:
        zero = torch.zeros(batch, self.node_count, 3, device=self.device)
        return State(zero, zero, zero if self.model.settings.uses_prior else None)

    def draw(self, count: int, generator: torch.Generator) -> Encoded:
        """`count` of the supernodes, and the nodes that these read."""
        chosen = torch.randperm(len(self.all.supernodes), generator=generator)[:count].sort().values.to(self.device)
        neighbours, mask, supernodes = (part[chosen] for part in self.all[:3])
        read = torch.zeros(self.node_count, dtype=torch.bool, device=self.device)
        read[neighbours[mask > 0]] = True
        read[supernodes] = True
        return Encoded(neighbours, mask, supernodes, read.nonzero()[:, 0])

    def step(
        self, state: State, target: dict[str, torch.Tensor], tables, scored=None, encoded: Encoded | None = None
    ) -> State:
        """`target` holds `c`, `contact` and (where used) `prior` of the end of the step.

        `scored`: as in `Upt.forward`. `encoded`: all supernodes by default.
        """
        fields = {
            "displacement": state.u,
            "previous_displacement": state.previous,
            "collision": target["c"],
            "contact": target["contact"],
            "prior": target.get("prior"),
            "previous_prior": state.prior,
        }
        source, key, query = tables
        features = self.model.normalise(fields)
        encoded = self.all if encoded is None else encoded
        out = self.model(features, (source, key), *encoded[:3], query, scored).float()
        base = self.model.settings.base
        if base == "displacement":
            out = out + state.u
        elif base == "prior":
            out = out + target["prior"]
        if self.exact:
            out = self.free * torch.where(target["contact"] > 0, target["c"], out)
        return State(out, state.u, target.get("prior"))


def squared_error(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """The paper's MSE of each sample: mean over nodes of the squared distance, mm², `[B]`."""
    return (a - b).square().sum(-1).mean(-1)


@torch.no_grad()
def cache_rollout(stepper: Stepper, cache, cases: np.ndarray, rows: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Autoregressive rollouts from rest over all frames: `mse [cases, F-1]` mm², `max [cases, F-1]` mm.

    F is that of the longest case; a shorter one is NaN after its end. `rows`: the rows of the cache's nodes that are
    scored; all by default.
    """
    rows = torch.arange(stepper.node_count) if rows is None else torch.from_numpy(rows)
    rows = rows.to(stepper.device)
    model = stepper.model
    was_training = model.training
    model.eval()
    tables, state = stepper.tables(), stepper.rest(len(cases))
    mse, largest, moved = [], [], []
    frames = cache.frames[cases]
    for t in range(1, frames.max()):
        target = {k: v.to(stepper.device) for k, v in cache.fields(cases, np.full(len(cases), t)).items()}
        state = stepper.step(state, target, tables)
        found, truth = state.u[:, rows], target["u"][:, rows]
        mse.append(squared_error(found, truth).cpu().numpy())
        largest.append((found - truth).abs().amax(dim=(1, 2)).cpu().numpy())
        moved.append(found.abs().amax(dim=(1, 2)).cpu().numpy())
    model.train(was_training)
    ended = np.arange(1, frames.max()) >= frames[:, None]
    stack = [np.where(ended, np.float32(np.nan), np.stack(x, axis=1)) for x in (mse, largest, moved)]
    return {"mse": stack[0], "max": stack[1], "moved": stack[2]}


def autoregressive_scores(result: dict[str, np.ndarray]) -> dict[str, float]:
    """Averages over cases as in the paper: the first step is excluded; the maximum is over all the others."""
    return {
        "mse_mm2": float(np.nanmean(result["mse"][:, 1:], axis=1).mean()),
        "max_mm": float(np.nanmax(result["max"][:, 1:], axis=1).mean()),
    }
