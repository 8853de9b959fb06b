"""Evaluates the linear-elastic response `L(c)` from `prior.safetensors` (docs/reference/formats.md).

Contact forces `f = A_CC^-1 c`, block coordinates `q = f response`, field `u_block = U_k q_k`. Lengths mm, forces mN.
With `vibration.safetensors` the response goes on swinging when the contact is gone; without, it is zero then.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from upt_training.dataset import map_safetensors
from upt_training.errors import InputError
from upt_training.reduced.near import whole_compliance
from upt_training.reduced.ragged import whole_response
from upt_training.reduced.stepped import in_numbers

DENSE_LIMIT = 1 << 30  # bytes of a dense table made by `restrict`


class PriorTable:
    """`response(nodes, vectors)` gives `L(c)` at the chosen field nodes, `[n, 3]` mm; `sequence()` a rollout of it."""

    def __init__(
        self,
        path: Path,
        node_count: int,
        vibration: Path | None = None,
        damping_per_s: float = 20.0,
        dt_s: float = 0.05,
    ):
        tensors, _ = map_safetensors(Path(path))
        for name in (
            "contact_nodes",
            "block_nodes",
            "block_offsets",
            "rank_offsets",
            "basis",
            "response",
        ):
            if name not in tensors:
                raise InputError(f"{path}: tensor {name!r} is missing; this is not a prior")
        tensors = in_numbers(tensors)
        if len(tensors["block_nodes"]) != node_count:
            raise InputError(f"{path}: made for {len(tensors['block_nodes'])} nodes, the mesh has {node_count}")
        self.path, self.node_count = Path(path), node_count
        self.row = np.full(node_count, -1)
        self.row[tensors["contact_nodes"]] = np.arange(len(tensors["contact_nodes"]))
        self.compliance = whole_compliance(tensors, path).astype(np.float64)
        self.response_q = np.asarray(whole_response(tensors), np.float32)
        self.blocks = []
        basis, at = np.asarray(tensors["basis"], np.float32), 0
        offsets, ranks, nodes = (
            tensors["block_offsets"],
            tensors["rank_offsets"],
            np.asarray(tensors["block_nodes"]),
        )
        for k in range(len(offsets) - 1):
            members = nodes[offsets[k] : offsets[k + 1]]
            rank = int(ranks[k + 1] - ranks[k])
            size = 3 * len(members) * rank
            self.blocks.append((members, int(ranks[k]), basis[at : at + size].reshape(3 * len(members), rank)))
            at += size
        self.dense, self.nodes = None, None
        self.vibration, self.files = None, [self.path]
        if vibration is not None:
            self.files.append(Path(vibration))
            self.vibration = load_vibration(vibration, self.response_q.shape, damping_per_s, dt_s)

    def restrict(self, nodes: np.ndarray | None) -> PriorTable:
        """Answer for these nodes only (None: all), by one dense product where the table fits."""
        wanted = np.arange(self.node_count) if nodes is None else np.asarray(nodes)
        out = object.__new__(PriorTable)
        out.__dict__.update(self.__dict__)
        out.nodes, out.dense = wanted, None
        if self.response_q.shape[0] * 3 * len(wanted) * 4 <= DENSE_LIMIT:
            out.dense = self.fields(self.response_q, wanted)
        if self.vibration is not None:
            out.mode_fields = self.fields(self.vibration.modes, wanted)
        return out

    def fields(self, table: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Fields `[r, 3n]` at nodes `[n]` of rows of block coordinates `[r, Q]`."""
        place = np.full(self.node_count, -1)
        place[nodes] = np.arange(len(nodes))
        out = np.zeros((len(table), len(nodes), 3), np.float32)
        for members, start, basis in self.blocks:
            here = place[members] >= 0
            if here.any():
                part = basis.reshape(len(members), 3, -1)[here].reshape(-1, basis.shape[1])
                field = table[:, start : start + basis.shape[1]] @ part.T
                out[:, place[members[here]]] = field.reshape(len(field), -1, 3)
        return out.reshape(len(out), -1)

    def sequence(self) -> ResponseSequence:
        """The response step by step, from rest."""
        return ResponseSequence(self)

    @property
    def width(self) -> int:
        """Number of block coordinates, `Q`."""
        return self.response_q.shape[1]

    def project(self, fields: np.ndarray) -> np.ndarray:
        """Block coordinates `[m, Q]` of fields `[m, 3K]`: products with the orthonormal bases."""
        fields = fields.reshape(len(fields), -1, 3)
        out = np.zeros((len(fields), self.width), fields.dtype)
        for members, start, basis in self.blocks:
            out[:, start : start + basis.shape[1]] = fields[:, members].reshape(len(fields), -1) @ basis
        return out

    def forces(self, nodes: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact dofs and the forces there that impose `vectors`."""
        known = self.row[nodes] >= 0
        dofs = (3 * self.row[nodes[known]][:, None] + np.arange(3)).ravel()
        block = self.compliance[np.ix_(dofs, dofs)]
        block = 0.5 * (block + block.T)
        try:
            return dofs, cho_solve(cho_factor(block), np.asarray(vectors[known], np.float64).ravel())
        except np.linalg.LinAlgError:
            shift = 1e-6 * np.trace(block) / len(block)
            factor = cho_factor(block + shift * np.eye(len(block)))
            return dofs, cho_solve(factor, np.asarray(vectors[known], np.float64).ravel())

    def response(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Contact nodes `[m]`, prescribed displacement `[m, 3]` mm -> `L(c)` `[n, 3]` mm float32."""
        if self.nodes is None:
            return self.restrict(None).response(nodes, vectors)
        if len(nodes) == 0:
            return np.zeros((len(self.nodes), 3), np.float32)
        return self.field(*self.forces(np.asarray(nodes), np.asarray(vectors)))

    def field(self, dofs: np.ndarray, force: np.ndarray) -> np.ndarray:
        """The field `[n, 3]` mm of contact forces (mN) at contact dofs."""
        force = force.astype(np.float32)
        if self.dense is not None:
            return (force @ self.dense[dofs]).reshape(-1, 3)
        q = force @ self.response_q[dofs]
        field = np.zeros((self.node_count, 3), np.float32)
        for members, start, basis in self.blocks:
            field[members] = (basis @ q[start : start + basis.shape[1]]).reshape(-1, 3)
        return field[self.nodes]


@dataclass
class Vibration:
    """Free modes in block coordinates: `modes [m, Q]`, `force_to_mode [3D, m]`, exact step `propagator [m, 4]`."""

    modes: np.ndarray
    force_to_mode: np.ndarray
    propagator: np.ndarray


def load_vibration(path: Path, shape: tuple[int, int], damping_per_s: float, dt_s: float) -> Vibration:
    """Reads `vibration.safetensors` for a prior whose `response` has this shape `[3D, Q]`."""
    tensors, _ = map_safetensors(Path(path))
    for name in ("frequency", "modes", "force_to_mode"):
        if name not in tensors:
            raise InputError(f"{path}: tensor {name!r} is missing; make it with `python -m upt_training.vibration`")
    count = len(tensors["frequency"])
    for name, wanted in (("modes", (count, shape[1])), ("force_to_mode", (shape[0], count))):
        if tensors[name].shape != wanted:
            raise InputError(f"{path}: {name} is {tensors[name].shape}, this prior needs {wanted}; make it again")
    steps = propagator(np.asarray(tensors["frequency"], np.float64), damping_per_s, dt_s).astype(np.float32)
    return Vibration(np.asarray(tensors["modes"]), np.asarray(tensors["force_to_mode"]), steps)


def propagator(frequency: np.ndarray, damping_per_s: float, dt_s: float) -> np.ndarray:
    """`[m, 4]`: A, B, C, D of `z' = A z + B w`, `w' = C z + D w` for `z'' + damping z' + frequency² z = 0`.

    Exact over a step; `w` is the velocity times `dt`, `frequency` in rad/s.
    """
    half = damping_per_s / 2.0
    root = np.sqrt((frequency**2 - half**2).astype(complex) + 1e-12)
    decay = np.exp(-half * dt_s)
    impulse = (decay * np.sin(root * dt_s) / root).real
    place = (decay * np.cos(root * dt_s)).real + half * impulse
    return np.stack([place, impulse / dt_s, -(frequency**2) * impulse * dt_s, place - damping_per_s * impulse], axis=1)


class ResponseSequence:
    """`L(c)` while in contact; then the free vibration that starts from it (zero without vibration tables)."""

    def __init__(self, table: PriorTable):
        self.table = table if table.nodes is not None else table.restrict(None)
        self.reset()

    def reset(self) -> None:
        """Back to rest."""
        count = 0 if self.table.vibration is None else len(self.table.vibration.modes)
        self.place, self.velocity = np.zeros((2, count), np.float32)

    def step(self, nodes: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """The field `[n, 3]` mm at the end of a step with this contact (nodes `[m]`, displacement `[m, 3]` mm)."""
        table, vibration = self.table, self.table.vibration
        if len(nodes):
            dofs, force = table.forces(np.asarray(nodes), np.asarray(vectors))
            if vibration is not None:
                place = force.astype(np.float32) @ vibration.force_to_mode[dofs]
                self.place, self.velocity = place, place - self.place
            return table.field(dofs, force)
        if vibration is None:
            return np.zeros((len(table.nodes), 3), np.float32)
        a, b, c, d = vibration.propagator.T
        z, w = self.place, self.velocity
        self.place, self.velocity = a * z + b * w, c * z + d * w
        return (self.place @ table.mode_fields).reshape(-1, 3)
