"""Reads datasets (docs/reference/formats.md): trajectories are memory-mapped, nothing is loaded before it is asked for.

Row `t` of the contact arrays holds at the end of the step from frame `t - 1` to frame `t`; contact nodes of row `t`
have displacement `c` in frame `t`. So the surrogate learns `M(u[t-1], c[t]) = u[t]`. Lengths in mm.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upt_training.errors import InputError
from upt_training.loads import STATIC
from upt_training.mesh_file import Mesh

DTYPES = {
    "F32": np.dtype("<f4"),
    "F16": np.dtype("<f2"),
    "I32": np.dtype("<i4"),
    "F64": np.dtype("<f8"),
    "U8": np.dtype("u1"),
}


def map_safetensors(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Memory-mapped tensors and the metadata of a safetensors file; a truncated file is an `InputError`."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file")
    size = path.stat().st_size
    with path.open("rb") as file:
        prefix = file.read(8)
        length = int.from_bytes(prefix, "little")
        if len(prefix) < 8 or 8 + length > size:
            raise InputError(f"{path}: truncated ({size} bytes); make or copy it again")
        try:
            header = json.loads(file.read(length))
        except ValueError as error:
            raise InputError(f"{path}: not a safetensors file ({error})") from error
    metadata = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        begin, end = (8 + length + o for o in entry["data_offsets"])
        if end > size:
            raise InputError(f"{path}: truncated: tensor {name!r} ends at byte {end}, the file has {size}")
        if entry["dtype"] not in DTYPES:
            raise InputError(f"{path}: tensor {name!r} has dtype {entry['dtype']}, which this reader does not take")
        shape, dtype = tuple(entry["shape"]), DTYPES[entry["dtype"]]
        if begin == end:
            tensors[name] = np.zeros(shape, dtype)
        else:
            tensors[name] = np.memmap(path, dtype, "r", begin, shape)
    return tensors, metadata


@dataclass
class Trajectory:
    """One simulated case. `displacement [F, K, 3]` is memory-mapped."""

    path: Path
    displacement: np.ndarray
    offsets: np.ndarray
    nodes: np.ndarray
    vectors: np.ndarray
    metadata: dict[str, str]

    @property
    def frame_count(self) -> int:
        return len(self.displacement)

    @property
    def scheme(self) -> str:
        return self.metadata.get("scheme", "")

    def contact(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes `[m]` and prescribed displacement `[m, 3]` mm of the row `frame`."""
        row = slice(int(self.offsets[frame]), int(self.offsets[frame + 1]))
        return self.nodes[row], self.vectors[row]

    def read(self, nodes: np.ndarray | None = None) -> np.ndarray:
        """`[F, n, 3]` float32, checked to be finite."""
        values = self.displacement if nodes is None else self.displacement[:, nodes]
        values = np.asarray(values, np.float32)
        if not np.isfinite(values).all():
            frame, node, axis = (int(i) for i in np.argwhere(~np.isfinite(values))[0])
            node = node if nodes is None else int(nodes[node])
            raise InputError(f"{self.path}: displacement[{frame}, {node}, {axis}] is not finite; simulate it again")
        return values


def open_trajectory(path: Path, mesh: Mesh | None = None) -> Trajectory:
    """Open and check one trajectory; `mesh` must be the one it was simulated on."""
    path = Path(path)
    tensors, metadata = map_safetensors(path)
    for name in ("displacement", "contact_offsets", "contact_nodes", "contact_vectors"):
        if name not in tensors:
            raise InputError(f"{path}: tensor {name!r} is missing; this is not a trajectory")
    u = tensors["displacement"]
    if u.ndim != 3 or u.shape[2] != 3:
        raise InputError(f"{path}: displacement has shape {u.shape}, expected [frames, nodes, 3]")
    if len(tensors["contact_offsets"]) != len(u) + 1:
        raise InputError(f"{path}: contact_offsets has {len(tensors['contact_offsets'])} rows, expected {len(u) + 1}")
    if not np.isfinite(tensors["contact_vectors"]).all():
        entry = int(np.argwhere(~np.isfinite(tensors["contact_vectors"]))[0, 0])
        raise InputError(f"{path}: contact_vectors[{entry}] is not finite; simulate it again")
    if mesh is not None:
        found = metadata.get("mesh_sha256", "")
        if found != mesh.sha256 or u.shape[1] != mesh.node_count:
            raise InputError(
                f"{path}: simulated on another mesh (sha256 {found[:12]}…, {u.shape[1]} nodes; the mesh given has "
                f"{mesh.sha256[:12]}…, {mesh.node_count} nodes); pass the mesh the data was made with"
            )
    return Trajectory(
        path,
        u,
        tensors["contact_offsets"],
        tensors["contact_nodes"],
        tensors["contact_vectors"],
        metadata,
    )


@dataclass
class Case:
    index: int
    path: Path
    scheme: str
    split: str


@dataclass
class Dataset:
    """A folder of trajectories and its manifest; failed cases are left out."""

    folder: Path
    manifest: dict
    cases: list[Case]

    def select(self, split: str, schemes: list[str] | None = None, count: int = 0) -> list[Case]:
        """Cases of a split (`train`, `test`, `all`), by scheme, the first `count` of them balanced by index."""
        chosen = [c for c in self.cases if split in (c.split, "all") and (not schemes or c.scheme in schemes)]
        return chosen[:count] if count else chosen


def open_dataset(folder: Path | str, mesh: Mesh) -> Dataset:
    """Read `manifest.json`; every case's file must exist, be whole and be of this mesh. Equilibria are passed over."""
    folder = Path(folder)
    path = folder / "manifest.json"
    if not path.exists():
        raise InputError(f"{path}: no such file; make a dataset with `upt dataset`")
    try:
        manifest = json.loads(path.read_text())
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON ({error})") from error
    if manifest.get("format") != "upt-dataset":
        raise InputError(f"{path}: format is {manifest.get('format')!r}, expected 'upt-dataset'")
    if manifest.get("mesh_sha256") != mesh.sha256:
        raise InputError(
            f"{path}: dataset of another mesh (sha256 {str(manifest.get('mesh_sha256'))[:12]}…, the mesh given has "
            f"{mesh.sha256[:12]}…); pass the mesh the data was made with"
        )
    cases = []
    for entry in manifest["cases"]:
        if entry.get("status") != "done" or str(entry["scheme"]) in STATIC:
            continue
        file = folder / entry["file"]
        open_trajectory(file, mesh)
        cases.append(Case(int(entry["index"]), file, str(entry["scheme"]), entry["split"]))
    if not cases:
        raise InputError(f"{path}: no finished case of a moving scheme; let `upt dataset` finish")
    return Dataset(folder, manifest, cases)
