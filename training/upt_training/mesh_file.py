"""Mesh files (`*.mesh.safetensors`, docs/reference/formats.md): read, write, hash.

`positions` are rest positions in mm, `[K, 3]` float32; `tets` `[T, 4]` int32; `surface` `[F, 3]` int32, outward;
`domain` `[D]` rows of `surface` that instruments may touch; `fixed` and `supported` are ascending node sets;
`stiffness` `[T]` float32 is Young's modulus of each tetrahedron over the material's, empty for a uniform body;
`region` `[T]` int32 is 0 or one more than the place of the tetrahedron's region in the metadata's list `laws`.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from upt_training.errors import InputError


@dataclass
class Mesh:
    """A tetrahedral mesh with its named sets. Lengths in mm."""

    positions: np.ndarray
    tets: np.ndarray
    surface: np.ndarray
    domain: np.ndarray
    fixed: np.ndarray
    supported: np.ndarray
    metadata: dict = field(default_factory=dict)
    stiffness: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))
    region: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    fibre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    @property
    def node_count(self) -> int:
        return len(self.positions)

    @property
    def sha256(self) -> str:
        """The mesh hash: SHA-256 of positions, tets, fixed, supported and, if any, stiffness, region, laws, fibre."""
        digest = hashlib.sha256()
        for array in (self.positions, self.tets, self.fixed, self.supported, self.stiffness):
            digest.update(np.ascontiguousarray(array).tobytes())
        if len(self.region):
            digest.update(np.ascontiguousarray(self.region).tobytes())
            digest.update(self.metadata.get("laws", "").encode())
        digest.update(np.ascontiguousarray(self.fibre).tobytes())
        return digest.hexdigest()

    def density(self, own: float) -> np.ndarray:
        """Density of each tetrahedron, `[T]` kg/m³, in a body of density `own`: a region may have one of its own."""
        laws = json.loads(self.metadata.get("laws", "[]"))
        of_region = np.array([own, *(law.get("density_kg_m3") or own for law in laws)], np.float64)
        return of_region[self.region] if len(self.region) else np.full(len(self.tets), of_region[0])

    @property
    def domain_nodes(self) -> np.ndarray:
        """Nodes of the domain's faces, ascending."""
        return np.unique(self.surface[self.domain])

    def held_nodes(self, boundary: str) -> np.ndarray:
        """Nodes held at zero under the boundary condition `fixed` or `supported`, ascending."""
        if boundary == "fixed":
            return self.fixed
        if boundary == "supported":
            return np.union1d(self.fixed, self.supported).astype(np.int32)
        raise InputError(f"boundary {boundary!r} is unknown: use 'fixed' or 'supported'")

    def node_areas(self) -> np.ndarray:
        """A third of the area of each node's surface faces, mm², `[K]` float64."""
        corner = self.positions[self.surface].astype(np.float64)
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        area = 0.5 * np.linalg.norm(normal, axis=1)
        out = np.zeros(self.node_count)
        np.add.at(out, self.surface.ravel(), np.repeat(area / 3.0, 3))
        return out

    def save(self, path: Path) -> None:
        metadata = {"format": "upt-mesh", "version": "1", "units": "mm", **self.metadata}
        tensors = {
            "positions": np.ascontiguousarray(self.positions, np.float32),
            "tets": np.ascontiguousarray(self.tets, np.int32),
            "surface": np.ascontiguousarray(self.surface, np.int32),
            "domain": np.ascontiguousarray(self.domain, np.int32),
            "fixed": np.ascontiguousarray(self.fixed, np.int32),
            "supported": np.ascontiguousarray(self.supported, np.int32),
        }
        if len(self.stiffness):
            tensors["stiffness"] = np.ascontiguousarray(self.stiffness, np.float32)
        if len(self.region):
            tensors["region"] = np.ascontiguousarray(self.region, np.int32)
        if len(self.fibre):
            tensors["fibre"] = np.ascontiguousarray(self.fibre, np.float32)
        save_file(tensors, str(path), metadata={k: str(v) for k, v in metadata.items()})
        Path(path).chmod(0o644)


def load_mesh(path: Path | str) -> Mesh:
    """Read a mesh file; raises `InputError` that names the file and the field."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such mesh file")
    try:
        with safe_open(str(path), "numpy") as file:
            metadata = file.metadata() or {}
            names = set(file.keys())
            missing = {"positions", "tets", "surface"} - names
            if missing:
                raise InputError(f"{path}: tensor {sorted(missing)[0]!r} is missing; this is not a mesh file")
            empty = np.zeros(0, np.int32)
            get = {n: file.get_tensor(n) if n in names else empty for n in _TENSORS}
            stiffness = file.get_tensor("stiffness") if "stiffness" in names else np.zeros(0, np.float32)
            region = file.get_tensor("region") if "region" in names else empty
            fibre = file.get_tensor("fibre") if "fibre" in names else np.zeros((0, 3), np.float32)
    except SafetensorError as error:
        raise InputError(f"{path}: not a readable safetensors file ({error}); make the mesh again") from error
    mesh = Mesh(**get, stiffness=stiffness, region=region, fibre=fibre, metadata=metadata)
    if not np.isfinite(mesh.positions).all():
        node = int(np.argwhere(~np.isfinite(mesh.positions))[0, 0])
        raise InputError(f"{path}: positions of node {node} are not finite")
    if len(stiffness) and (len(stiffness) != len(mesh.tets) or not (np.isfinite(stiffness) & (stiffness > 0)).all()):
        raise InputError(f"{path}: stiffness must hold a finite positive number for each of the {len(mesh.tets)} tets")
    laws = json.loads(metadata.get("laws", "[]"))
    if len(region) and (len(region) != len(mesh.tets) or region.min() < 0 or region.max() > len(laws)):
        raise InputError(
            f"{path}: region must hold 0 to {len(laws)}, the number of laws, for each of the {len(mesh.tets)} tets"
        )
    if len(fibre) and fibre.shape != (len(mesh.tets), 3):
        raise InputError(f"{path}: fibre must hold a unit vector, or zeros, for each of the {len(mesh.tets)} tets")
    for name in ("tets", "surface", "fixed", "supported"):
        array = getattr(mesh, name)
        if array.size and (array.min() < 0 or array.max() >= mesh.node_count):
            raise InputError(f"{path}: {name} names a node outside 0..{mesh.node_count - 1}")
    return mesh


_TENSORS = ("positions", "tets", "surface", "domain", "fixed", "supported")
