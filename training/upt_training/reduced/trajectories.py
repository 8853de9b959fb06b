"""Trajectories of a dataset folder (docs/reference/formats.md), memory-mapped, with contact forces."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upt_training.errors import InputError
from upt_training.loads import STATIC
from upt_training.reduced.columns import Columns, map_tensors
from upt_training.reduced.prior import trajectory_forces

DAMPING_PER_S = 20.0  # What the correction is made for, and what a trajectory without a material has.


@dataclass
class Case:
    """One trajectory. Row `t` of the contact arrays holds at the end of the step to frame `t`."""

    path: Path
    scheme: str
    split: str
    displacement: np.ndarray
    offsets: np.ndarray
    nodes: np.ndarray
    vectors: np.ndarray
    site: np.ndarray
    damping_per_s: float

    @property
    def frames(self) -> int:
        return len(self.offsets) - 1

    @property
    def is_static(self) -> bool:
        """Whether the frames are equilibria without an order in time."""
        return self.scheme in STATIC

    def contact_row(self, frame: int) -> np.ndarray:
        return self.nodes[self.offsets[frame] : self.offsets[frame + 1]]

    def fields(self, start: int = 0, end: int | None = None) -> np.ndarray:
        """Displacement of frames `start..end`, `[n, 3K]` float32, mm."""
        part = np.asarray(self.displacement[start:end], np.float32)
        return part.reshape(len(part), -1)

    def forces(self, columns: Columns) -> np.ndarray:
        """Contact forces of all frames, `[F, 3D]` float32, mN."""
        return trajectory_forces(columns.contact_nodes, columns.compliance, self.offsets, self.nodes, self.vectors)

    def in_contact(self) -> np.ndarray:
        """Whether each frame has a contact node, `[F]`."""
        return np.diff(self.offsets) > 0

    def set_changed(self) -> np.ndarray:
        """Whether each frame's set of contact nodes differs from that of the frame before, `[F]`."""
        changed = np.zeros(self.frames, bool)
        for frame in range(1, self.frames):
            changed[frame] = not np.array_equal(self.contact_row(frame), self.contact_row(frame - 1))
        return changed

    def largest_push(self) -> np.ndarray:
        """Largest `|c|` of each frame, mm, `[F]`."""
        length = np.linalg.norm(self.vectors, axis=1)
        bounds = zip(self.offsets[:-1], self.offsets[1:], strict=True)
        return np.array([length[a:b].max(initial=0.0) for a, b in bounds])


def open_case(path: Path, scheme: str, split: str, mesh_sha256: str) -> Case:
    """Open one trajectory; refuses one of another mesh."""
    tensors, metadata = map_tensors(path)
    if metadata.get("mesh_sha256") != mesh_sha256:
        raise InputError(f"{path}: mesh_sha256 differs from the mesh's; simulate on this mesh")
    return Case(
        path,
        scheme,
        split,
        tensors["displacement"],
        np.array(tensors["contact_offsets"]),
        np.array(tensors["contact_nodes"]),
        np.array(tensors["contact_vectors"]),
        np.array(json.loads(metadata.get("site", "[0, 0, 0]"))),
        float(json.loads(metadata.get("material", "{}")).get("damping_per_s", DAMPING_PER_S)),
    )


def open_dataset(folder: Path | str, mesh_sha256: str, split: str | None = None) -> list[Case]:
    """Finished cases of a dataset folder, ascending by index; `split` is `train`, `test` or None for both."""
    folder = Path(folder)
    manifest = folder / "manifest.json"
    if not manifest.exists():
        raise InputError(f"{folder}: no manifest.json; make the dataset with `upt dataset`")
    listed = json.loads(manifest.read_text())
    cases = []
    for entry in sorted(listed["cases"], key=lambda entry: entry["index"]):
        if entry.get("status", "done") != "done" or (split and entry["split"] != split):
            continue
        cases.append(open_case(folder / entry["file"], str(entry["scheme"]), entry["split"], mesh_sha256))
    return cases
