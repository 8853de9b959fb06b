"""Compliance files of `upt prior`: `columns [3D,3K]`, `compliance [3D,3D]` (mm/mN), `contact_nodes [D]`.

Columns are memory-mapped: at 151,201 nodes they are 12 GB, and no step here needs them at once.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upt_training.errors import InputError

_DTYPES = {"F32": np.float32, "F16": np.float16, "I32": np.int32, "U8": np.uint8}


@dataclass
class Columns:
    """Static response to a unit force (1 mN) at each contact degree of freedom `3 * node + axis`."""

    path: Path
    contact_nodes: np.ndarray
    compliance: np.ndarray
    columns: np.ndarray
    metadata: dict

    @property
    def node_count(self) -> int:
        return self.columns.shape[1] // 3

    def rows(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row of each node in `contact_nodes`, and a mask of the nodes that have one."""
        return rows_of(self.contact_nodes, nodes)


def rows_of(contact_nodes: np.ndarray, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of each of `nodes` in the ascending `contact_nodes`; the mask is false (and the index 0) where absent."""
    at = np.minimum(np.searchsorted(contact_nodes, nodes), len(contact_nodes) - 1)
    found = contact_nodes[at] == nodes
    return np.where(found, at, 0), found


def map_tensors(path: Path | str) -> tuple[dict[str, np.ndarray], dict]:
    """Tensors of a safetensors file as read-only memory maps, and its metadata."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such file")
    with open(path, "rb") as file:
        length = int.from_bytes(file.read(8), "little")
        if length <= 0 or length > 100_000_000:
            raise InputError(f"{path}: not a safetensors file")
        header = json.loads(file.read(length))
    metadata = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        if entry["dtype"] not in _DTYPES:
            raise InputError(f"{path}: tensor {name} has dtype {entry['dtype']}, expected one of {sorted(_DTYPES)}")
        dtype, shape = _DTYPES[entry["dtype"]], tuple(entry["shape"])
        if 0 in shape:
            tensors[name] = np.zeros(shape, dtype)
        else:
            offset = 8 + length + entry["data_offsets"][0]
            tensors[name] = np.memmap(path, dtype, "r", offset, shape)
    return tensors, metadata


def load_columns(path: Path | str) -> Columns:
    """Open a compliance file; raises `InputError` naming the field that is missing."""
    tensors, metadata = map_tensors(path)
    for name in ("columns", "compliance", "contact_nodes"):
        if name not in tensors:
            raise InputError(f"{path}: tensor {name!r} is missing; make the file with `upt prior`")
    return Columns(
        Path(path),
        np.array(tensors["contact_nodes"]),
        np.array(tensors["compliance"]),
        tensors["columns"],
        metadata,
    )


def contact_forces(compliance: np.ndarray, rows: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """`f = A_CC^-1 c`: forces `[..., m, 3]` (mN) for prescribed `vectors` `[..., m, 3]` (mm) at contact `rows` `[m]`.

    A block that is not positive definite gets 1e-9, 1e-6 or 1e-3 of its mean diagonal added, as in the runtime.
    """
    dofs = (3 * rows[:, None] + np.arange(3)).ravel()
    block = compliance[np.ix_(dofs, dofs)].astype(np.float64)
    flat = np.asarray(vectors, np.float64).reshape(*np.shape(vectors)[:-2], len(dofs))
    mean = np.trace(block) / max(len(dofs), 1)
    for share in (0.0, 1e-9, 1e-6, 1e-3):
        try:
            factor = np.linalg.cholesky(block + share * mean * np.eye(len(dofs)))
        except np.linalg.LinAlgError:
            continue
        half = np.linalg.solve(factor, flat.reshape(-1, len(dofs)).T)
        return np.linalg.solve(factor.T, half).T.reshape(np.shape(vectors))
    raise InputError("the compliance of the contact nodes is singular: the contact set repeats a node")


def linear_fields(columns: Columns, forces: np.ndarray) -> np.ndarray:
    """`L = forces @ columns` over the touched degrees of freedom only, `[n, 3K]` float32, mm."""
    touched = np.flatnonzero(np.any(forces != 0.0, axis=0))
    if not len(touched):
        return np.zeros((len(forces), columns.columns.shape[1]), np.float32)
    return forces[:, touched].astype(np.float32) @ columns.columns[touched]
