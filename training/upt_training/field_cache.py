"""What training reads: displacement, linear response and contact mask of a node subset, half precision, memory-mapped.

The recurrence and the loss touch only a subset of the nodes (the encoder's needed nodes and the scored ones), so each
case is reduced to `[frames, n]` arrays once; 200 cases at 6,000 nodes are 2.3 GB on disk and the operating system
pages in what is used. Cases that are added to a dataset later are added to its cache. The collision field needs no
array: at contact nodes it is the displacement itself.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from upt_training.dataset import Case, open_trajectory
from upt_training.mesh_file import Mesh
from upt_training.prior_table import PriorTable

TORCH = {np.dtype(np.float16): torch.float16, np.dtype(np.uint8): torch.uint8}


@dataclass
class FieldCache:
    """A list of cases; each `displacement [F, n, 3]` and `prior [F, n, 3]` f16 mm, `contact [F, n]` u8, with its own F.

    `nodes`: ascending mesh indices of the `n` nodes.
    """

    nodes: np.ndarray
    displacement: list[np.ndarray]
    contact: list[np.ndarray]
    prior: list[np.ndarray] | None
    resident: dict[str, torch.Tensor] = field(default_factory=dict)  # all cases in a row, `[sum of F, n, ...]`
    frames: np.ndarray = field(init=False)  # F of each case
    starts: np.ndarray = field(init=False)  # of each case, in such a row

    def __post_init__(self) -> None:
        self.frames = np.array([len(case) for case in self.displacement])
        self.starts = np.cumsum(self.frames) - self.frames

    @property
    def case_count(self) -> int:
        return len(self.displacement)

    def hold(self, limit_gb: float, device: torch.device) -> bool:
        """Keep the cases in the device's memory if they take no more than `limit_gb`, to be read by one gather."""
        parts = {"u": self.displacement, "contact": self.contact, "prior": self.prior}
        parts = {name: arrays for name, arrays in parts.items() if arrays is not None}
        if sum(a.nbytes for arrays in parts.values() for a in arrays) > limit_gb * 1e9:
            return False
        for name, arrays in parts.items():
            rows = torch.empty((self.frames.sum(), *arrays[0].shape[1:]), dtype=TORCH[arrays[0].dtype])
            for start, array in zip(self.starts, arrays, strict=True):
                rows[start : start + len(array)] = torch.from_numpy(np.array(array))
            self.resident[name] = rows.to(device)
        return True

    def fields(self, case: np.ndarray, frame: np.ndarray) -> dict[str, torch.Tensor]:
        """Truth at `frame` (`[B]`, -1 is rest): `u`, `c`, `prior` `[B, n, 3]` mm, `contact` `[B, n, 1]`.

        After its end a case stays at its last frame.
        """
        frame = np.clip(frame, 0, self.frames[case] - 1)
        index = torch.from_numpy(self.starts[case] + frame)

        def read(name: str, arrays: list[np.ndarray]) -> torch.Tensor:
            if name in self.resident:
                rows = self.resident[name]
                return rows.index_select(0, index.to(rows.device)).float()
            return torch.from_numpy(
                np.stack([arrays[c][t] for c, t in zip(case, frame, strict=True)]).astype(np.float32)
            )

        u, contact = read("u", self.displacement), read("contact", self.contact)[..., None]
        out = {"u": u, "contact": contact, "c": u * contact}
        if self.prior is not None:
            out["prior"] = read("prior", self.prior)
        return out


def build_cache(folder: Path, mesh: Mesh, cases: list[Case], nodes: np.ndarray, prior: PriorTable | None) -> FieldCache:
    """Open the cached arrays of these cases and nodes under `folder`; make those that are missing."""
    key = hashlib.sha256()
    for part in (mesh.sha256.encode(), nodes.astype(np.int64).tobytes()):
        key.update(part)
    for path in [] if prior is None else prior.files:
        key.update(f"{path.resolve()}:{path.stat().st_size}".encode())
    out = Path(folder) / key.hexdigest()[:16]
    local = None
    displacement, contact, response = [], [], []
    for case in cases:
        status = case.path.stat()
        stamp = hashlib.sha256(f"{case.path.resolve()}:{status.st_size}:{status.st_mtime_ns}".encode()).hexdigest()[:12]
        stem = out / f"{case.index:05d}-{stamp}"
        if not stem.with_suffix(".contact.npy").exists():
            if local is None and prior is not None:
                local = prior.restrict(nodes)
            out.mkdir(parents=True, exist_ok=True)
            _write_case(stem, mesh, case, nodes, local)
        displacement.append(np.load(stem.with_suffix(".displacement.npy"), mmap_mode="r"))
        contact.append(np.load(stem.with_suffix(".contact.npy"), mmap_mode="r"))
        if prior is not None:
            response.append(np.load(stem.with_suffix(".prior.npy"), mmap_mode="r"))
    return FieldCache(nodes, displacement, contact, response if prior is not None else None)


def join_caches(parts: list[FieldCache]) -> FieldCache:
    """The cases of several datasets behind one another; all have the same nodes."""
    prior = None if parts[0].prior is None else [case for part in parts for case in part.prior or []]
    displacement = [case for part in parts for case in part.displacement]
    contact = [case for part in parts for case in part.contact]
    return FieldCache(parts[0].nodes, displacement, contact, prior)


def _write_case(stem: Path, mesh: Mesh, case: Case, nodes: np.ndarray, prior: PriorTable | None) -> None:
    """The contact array is moved into place last: its presence says that the case is complete."""
    trajectory = open_trajectory(case.path, mesh)
    place = np.full(mesh.node_count, -1)
    place[nodes] = np.arange(len(nodes))
    u = trajectory.read(nodes)
    contact = np.zeros(u.shape[:2], np.uint8)
    response = np.zeros_like(u)
    sequence = None if prior is None else prior.sequence()
    for t in range(len(u)):
        touched, vectors = trajectory.contact(t)
        at = place[touched]
        contact[t, at[at >= 0]] = 1
        u[t, at[at >= 0]] = vectors[at >= 0]
        if sequence is not None:
            response[t] = sequence.step(touched, vectors)
    if prior is not None:
        _save(stem.with_suffix(".prior.npy"), response.astype(np.float16))
    _save(stem.with_suffix(".displacement.npy"), u.astype(np.float16))
    _save(stem.with_suffix(".contact.npy"), contact)


def _save(path: Path, array: np.ndarray) -> None:
    staging = path.with_suffix(f".{os.getpid()}.tmp.npy")  # another process may make the same cache
    np.save(staging, array)
    staging.rename(path)
