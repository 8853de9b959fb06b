"""What training reads: displacement, linear response and contact mask of a node subset, half precision, memory-mapped.

The recurrence and the loss touch only a subset of the nodes (the encoder's needed nodes and the scored ones), so each
dataset is reduced to `[cases, frames, n]` arrays once; 200 cases at 6,000 nodes are 2.3 GB on disk and the operating
system pages in what is used. The collision field needs no array: at contact nodes it is the displacement itself.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import torch

from upt_training.dataset import Case, open_trajectory
from upt_training.mesh_file import Mesh
from upt_training.prior_table import PriorTable


class FieldCache:
    """Arrays over `cases` x `frames` x `nodes` (`nodes` ascending mesh indices)."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        self.header = json.loads((self.folder / "cache.json").read_text())
        self.nodes = np.load(self.folder / "nodes.npy")
        self.displacement = np.load(self.folder / "displacement.npy", mmap_mode="r")
        self.mask = np.load(self.folder / "contact.npy", mmap_mode="r")
        self.prior = np.load(self.folder / "prior.npy", mmap_mode="r") if self.header["prior"] else None

    @property
    def case_count(self) -> int:
        return len(self.displacement)

    @property
    def frame_count(self) -> int:
        return self.displacement.shape[1]

    def fields(self, case: np.ndarray, frame: np.ndarray) -> dict[str, torch.Tensor]:
        """Truth at `frame` (`[B]`, -1 is rest): `u`, `c`, `prior` `[B, n, 3]` mm, `contact` `[B, n, 1]`."""
        frame = np.maximum(frame, 0)
        u = torch.from_numpy(self.displacement[case, frame].astype(np.float32))
        contact = torch.from_numpy(self.mask[case, frame].astype(np.float32))[..., None]
        out = {"u": u, "contact": contact, "c": u * contact}
        if self.prior is not None:
            out["prior"] = torch.from_numpy(self.prior[case, frame].astype(np.float32))
        return out


def build_cache(folder: Path, mesh: Mesh, cases: list[Case], nodes: np.ndarray, prior: PriorTable | None) -> FieldCache:
    """Open the cache of these cases and nodes under `folder`, or make it (complete before it gets its name)."""
    key = hashlib.sha256()
    for part in (mesh.sha256.encode(), nodes.astype(np.int64).tobytes()):
        key.update(part)
    for case in cases:
        key.update(f"{case.path.resolve()}:{case.path.stat().st_size}".encode())
    if prior is not None:
        key.update(f"{prior.path.resolve()}:{prior.path.stat().st_size}".encode())
    out = Path(folder) / key.hexdigest()[:16]
    if (out / "cache.json").exists():
        return FieldCache(out)
    staging = out.with_name(out.name + ".new")
    shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir(parents=True)
    frames = open_trajectory(cases[0].path, mesh).frame_count
    shape = (len(cases), frames, len(nodes))
    new = np.lib.format.open_memmap
    displacement = new(staging / "displacement.npy", "w+", np.float16, (*shape, 3))
    contact = new(staging / "contact.npy", "w+", np.uint8, shape)
    response = new(staging / "prior.npy", "w+", np.float16, (*shape, 3)) if prior is not None else None
    local = prior.restrict(nodes) if prior is not None else None
    place = np.full(mesh.node_count, -1)
    place[nodes] = np.arange(len(nodes))
    for i, case in enumerate(cases):
        trajectory = open_trajectory(case.path, mesh)
        displacement[i] = trajectory.read(nodes)
        for t in range(frames):
            touched, vectors = trajectory.contact(t)
            at = place[touched]
            contact[i, t, at[at >= 0]] = 1
            displacement[i, t, at[at >= 0]] = vectors[at >= 0]
            if local is not None and len(touched):
                response[i, t] = local.response(touched, vectors)
    np.save(staging / "nodes.npy", nodes)
    header = {
        "prior": prior is not None,
        "schemes": [c.scheme for c in cases],
        "index": [c.index for c in cases],
    }
    (staging / "cache.json").write_text(json.dumps(header))
    del displacement, contact, response
    staging.rename(out)
    return FieldCache(out)
