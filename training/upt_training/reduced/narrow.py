"""`python -m upt_training.reduced narrow BUNDLE... --out FOLDER`: smaller tables for finished bundles of one body.

The first bundle is the body of the others. All get its response, in one block basis. A basis spans what sampled
contacts do in a block, and the modes that the bundles have (of corrections, of free vibration, learned ones), as far as
the tolerance asks; its coordinates are sorted by the contacts. A node's response keeps of each block the leading
coordinates (`ragged.py`), the compliance its near pairs (`near.py`), and what float16 holds is float16. Networks and
learned maps are untouched. With `--one-space` the others take the coarse space of corrections and the whole modes of
the first too.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file, save_file

from upt_training.bundle_folder import MANIFEST, file_entry, file_of, new_bundle, read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.reduced.block_basis import BlockBasis
from upt_training.reduced.near import near_tensors
from upt_training.reduced.patches import sample_forces
from upt_training.reduced.prior import load_prior
from upt_training.reduced.ragged import ragged_tensors
from upt_training.vibration import lumped_mass, stiffness

MESH, PRIOR, RESIDUAL = "mesh.safetensors", "prior.safetensors", "residual.safetensors"
HALF = 5e-4  # what float16 may lose of a table's norm


class Source:
    """A bundle as it was: its manifest, its tables, and the tensors in block coordinates of each of its files."""

    def __init__(self, folder: Path):
        self.folder, self.manifest = folder, read_manifest(folder)
        entry = self.manifest.get("prior")
        if not entry:
            raise InputError(f"{folder / MANIFEST}: has no linear response (`prior`)")
        self.prior = load_prior(self.file(entry["file"]), entry.get("residual") and self.file(entry["residual"]))
        files = {name: entry[name] for name in ("vibration", "release") if name in entry}
        if "corrections" in self.manifest:
            files["corrections"] = self.manifest["corrections"]["file"]
        self.files = files
        self.tensors = {name: load_file(self.file(file)) for name, file in files.items()}
        self.whole = self.manifest.get("corrections", {}).get("whole")
        self.dropped: set[str | None] = set()

    def file(self, name: str) -> Path:
        return file_of(self.folder, self.manifest, name)

    def modes(self) -> np.ndarray:
        """All modes in block coordinates `[n, Q]`, of length 1."""
        rows = [self.prior.residual, *(t["modes"] for t in self.tensors.values())]
        found = np.concatenate([np.asarray(part, np.float32) for part in rows])
        return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def common_basis(mesh: Mesh, sources: list[Source], tolerance_mm: float, mode_mm: float) -> tuple[BlockBasis, dict]:
    """One block basis for the contacts of the first bundle and the modes of all, and its error."""
    prior = sources[0].prior
    forces = sample_forces(mesh, prior, int(np.clip(3 * len(prior.contact_nodes), 1024, 4096)))
    q = prior.coordinates(forces) / np.float32(np.sqrt(len(forces)))
    modes = [source.modes() for source in sources]
    basis = BlockBasis(prior.basis.block_nodes, prior.basis.block_offsets, [])
    lost = 0.0
    for block, own in enumerate(prior.basis.bases):
        rank = prior.basis.rank_offsets
        contacts = (q[:, rank[block] : rank[block + 1]] @ own.T).astype(np.float64)
        gram = contacts.T @ contacts
        both = gram.copy()
        for source, rows in zip(sources, modes, strict=True):
            at, other = source.prior.basis.rank_offsets, source.prior.basis.bases[block]
            part = mode_mm * (rows[:, at[block] : at[block + 1]] @ other.T).astype(np.float64)
            both += part.T @ part
        found, left = leading(both, gram, tolerance_mm)
        basis.bases.append(found.astype(np.float16).astype(np.float32))
        lost += left
    return basis, {
        "rms_mm": float(np.sqrt(lost / mesh.node_count)),
        "coordinates": int(basis.rank_offsets[-1]),
        "max_rank": int(np.diff(basis.rank_offsets).max()),
    }


def leading(both: np.ndarray, contacts: np.ndarray, tolerance_mm: float) -> tuple[np.ndarray, float]:
    """The fewest directions `[dofs, r]`, r a multiple of 8, that leave out less than the tolerance of `both`, sorted by
    what `contacts` does in them; and what they leave out of `contacts`, mm² summed over the nodes."""
    dofs = len(both)
    energy, vectors = np.linalg.eigh(both)
    energy, vectors = np.maximum(energy[::-1], 0.0), vectors[:, ::-1]
    tail = np.concatenate([np.cumsum(energy[::-1])[::-1], [0.0]])
    rank = int(np.searchsorted(-tail, -(tolerance_mm**2) * (dofs // 3)))
    rank = min(max(8, -(-rank // 8) * 8), -(-dofs // 8) * 8)
    chosen = min(rank, dofs)
    span = vectors[:, :chosen] * (energy[:chosen] > 0.0)
    inside = span.T @ contacts @ span
    order = np.linalg.eigh(inside)[1][:, ::-1]
    out = np.zeros((dofs, rank))
    out[:, :chosen] = span @ order
    out[np.diag(both) == 0.0] = 0.0  # held
    return out, max(float(np.trace(contacts) - np.trace(inside)), 0.0)


def moved(source: Source, basis: BlockBasis, rows: np.ndarray) -> np.ndarray:
    """Rows of a bundle's block coordinates `[n, Q]` in those of the common basis, `[n, Q']`."""
    old = source.prior.basis
    at, rows = old.rank_offsets, np.asarray(rows, np.float32)
    parts = [
        rows[:, at[block] : at[block + 1]] @ (own.T @ new)
        for block, (own, new) in enumerate(zip(old.bases, basis.bases, strict=True))
    ]
    return np.concatenate(parts, axis=1)


def narrowed(values: np.ndarray) -> np.ndarray:
    """In float16 where that loses nothing that counts."""
    values = np.ascontiguousarray(values, np.float32)
    half = values.astype(np.float16)
    size = np.linalg.norm(values.astype(np.float64))
    return half if np.linalg.norm(half.astype(np.float64) - values) <= HALF * size else values


def fields_of(basis: BlockBasis, rows: np.ndarray, count: int) -> np.ndarray:
    """Fields `[n, 3K]` of block coordinates."""
    at = basis.rank_offsets
    out = np.zeros((len(rows), 3 * count), np.float32)
    for block, own in enumerate(basis.bases):
        out[:, basis.dofs(block)] = rows[:, at[block] : at[block + 1]].astype(np.float32) @ own.T
    return out


class Writer:
    """Writes what the bundles of a body have in the common basis."""

    def __init__(self, mesh: Mesh, material: dict, basis: BlockBasis):
        self.mesh, self.basis = mesh, basis
        names = ("young_pa", "poisson", "density_kg_m3")
        # mN/mm and kg -> µN/mm and g, as the files have them.
        self.stiffness = 1e3 * stiffness(mesh, {name: material[name] for name in names}).tocsr()
        self.mass = 1e3 * np.repeat(lumped_mass(mesh, material["density_kg_m3"]), 3)

    def prior(self, path: Path, source: Source, near_mm: float, drop: float) -> float:
        """`prior.safetensors`, without residual modes; returns the share of the response that is stored."""
        prior = source.prior
        response = moved(source, self.basis, prior.response)
        points = self.mesh.positions[prior.contact_nodes].astype(np.float64)
        rank = self.basis.rank_offsets
        ragged = ragged_tensors(response, rank, drop)
        tensors = {
            "contact_nodes": prior.contact_nodes.astype(np.int32),
            **near_tensors(prior.compliance, points, near_mm),
            "block_nodes": self.basis.block_nodes.astype(np.int32),
            "block_offsets": self.basis.block_offsets.astype(np.int32),
            "rank_offsets": rank,
            "basis": np.concatenate([one.ravel() for one in self.basis.bases]).astype(np.float16),
            **ragged,
        }
        write(path, tensors, {"format": "upt-prior", "version": "1", **prior.metadata})
        return ragged["response"].size / response.size

    def modes(self, path: Path, source: Source, name: str) -> None:
        """`vibration.safetensors` or `release.safetensors`."""
        tensors = dict(source.tensors[name])
        for key in ("modes", "projection"):
            if key in tensors:
                tensors[key] = narrowed(moved(source, self.basis, tensors[key]))
        write(path, tensors, {})  # the same bytes in each bundle: safetensors shuffles metadata

    def corrections(self, path: Path, source: Source, whole: Path | None) -> None:
        """The coarse space, and what the whole modes have in common with it."""
        modes = moved(source, self.basis, source.tensors["corrections"]["modes"])
        modes = (modes / np.linalg.norm(modes, axis=1, keepdims=True)).astype(np.float16)
        fields = fields_of(self.basis, modes, self.mesh.node_count)
        forces = np.stack([self.stiffness @ field for field in fields])
        inertia = fields * self.mass
        square = {"stiffness": fields @ forces.T, "mass": fields @ inertia.T}
        tensors = {
            "modes": modes,
            "frequency": source.tensors["corrections"]["frequency"],
            **{name: (0.5 * (one + one.T)).astype(np.float32) for name, one in square.items()},
        }
        write(path, tensors, {"format": "upt-corrections", "version": "1"})
        if whole and source.whole:
            kept = load_file(source.file(source.whole))
            v = kept["modes"].astype(np.float32).T
            kept["cross_stiffness"] = np.ascontiguousarray(forces @ v, np.float32)
            kept["cross_mass"] = np.ascontiguousarray(inertia @ v, np.float32)
            write(whole, kept, {"format": "upt-whole-modes", "version": "1"})


def write(path: Path, tensors: dict[str, np.ndarray], metadata: dict[str, str]) -> None:
    save_file(
        {name: np.ascontiguousarray(one) for name, one in sorted(tensors.items())},
        str(path),
        metadata={key: str(value) for key, value in metadata.items()} or None,
    )
    path.chmod(0o644)


def narrow(
    bundles: list[Path],
    out: Path,
    tolerance_mm: float = 6e-3,
    mode_mm: float = 1.0,
    near_mm: float = 20.0,
    drop: float = 1e-3,
    one_space: bool = False,
) -> dict:
    """Write a folder in `out` for each bundle, and return what became of the tables."""
    sources = [Source(folder) for folder in bundles]
    first = sources[0]
    for source in sources[1:]:
        for name, same in (
            ("mesh.mesh_sha256", source.manifest["mesh"]["mesh_sha256"] == first.manifest["mesh"]["mesh_sha256"]),
            ("boundary", source.manifest["boundary"] == first.manifest["boundary"]),
            ("material", source.manifest["material"] == first.manifest["material"]),
            ("prior", np.array_equal(source.prior.basis.block_nodes, first.prior.basis.block_nodes)),
        ):
            if not same:
                raise InputError(f"{source.folder / MANIFEST}: {name} is another than that of {first.folder}")
        if one_space and "corrections" in source.manifest and "corrections" not in first.manifest:
            raise InputError(f"{first.folder / MANIFEST}: has no `corrections` for the others to take")
    mesh = load_mesh(first.file(first.manifest["mesh"]["file"]))
    basis, about = common_basis(mesh, sources, tolerance_mm, mode_mm)
    writer = Writer(mesh, first.manifest["material"], basis)
    about |= {"tolerance_mm": tolerance_mm, "mode_mm": mode_mm, "near_mm": near_mm, "drop_mm_per_mn": drop}
    body = out / first.folder.name
    with new_bundle(body) as folder:
        shutil.copyfile(first.file(first.manifest["mesh"]["file"]), folder / MESH)
        about["stored"] = writer.prior(folder / PRIOR, first, near_mm, drop)
        rewrite(first, writer, folder, about)
        first.manifest.pop("body", None)
        write_manifest(folder, first.manifest)
    for source in sources[1:]:
        with new_bundle(out / source.folder.name) as folder:
            shared = [MESH, PRIOR]
            if one_space and "corrections" in source.manifest:
                shared += take_space(source, first)
            rewrite(source, writer, folder, about)
            listed = {name: file_entry(body / name) for name in shared}
            source.manifest = with_body(source.manifest, body.name) | {"files": listed}
            write_manifest(folder, source.manifest)
    return about


def take_space(source: Source, first: Source) -> list[str]:
    """The coarse space and the whole modes of the first bundle in place of a bundle's own; returns their files."""
    theirs = first.manifest["corrections"]
    entry = source.manifest["corrections"]
    entry["file"] = theirs["file"]
    entry.pop("whole", None)
    entry |= {name: theirs[name] for name in ("whole",) if name in theirs}
    source.dropped = {source.files.pop("corrections"), source.whole}
    source.whole = None
    return [entry[name] for name in ("file", "whole") if name in entry]


def with_body(manifest: dict, body: str) -> dict:
    """The manifest with the name of its body beside the boundary."""
    out = {}
    for key, value in manifest.items():
        if key != "body":
            out[key] = value
        if key == "boundary":
            out["body"] = body
    return out


def rewrite(source: Source, writer: Writer, folder: Path, about: dict) -> None:
    """A bundle's own files in the common basis, and what its manifest says of them."""
    manifest = source.manifest
    entry = manifest["prior"]
    tables = {entry["file"], entry.get("residual"), source.whole, manifest["mesh"]["file"]}
    tables |= {*source.files.values(), *source.dropped}
    for name in manifest["files"]:
        if name not in tables:
            shutil.copyfile(source.file(name), folder / name)
    manifest["mesh"]["file"], entry["file"] = MESH, PRIOR
    prior = source.prior
    if len(prior.residual):
        entry["residual"] = RESIDUAL
        tensors = {
            "residual": moved(source, writer.basis, prior.residual),
            "force_to_z": prior.force_to_z,
            "force_to_p": prior.force_to_p,
        }
        named = {name: narrowed(one) for name, one in tensors.items()}
        write(folder / RESIDUAL, named, {"format": "upt-residual", "version": "1"})
    for name, file in source.files.items():
        if name == "corrections":
            writer.corrections(folder / file, source, folder / source.whole if source.whole else None)
        else:
            writer.modes(folder / file, source, name)
    manifest["provenance"]["narrowed"] = about


def narrow_command(options: argparse.Namespace) -> None:
    names = ("tolerance_mm", "mode_mm", "near_mm", "drop", "one_space")
    about = narrow(options.bundles, options.out, **{name: getattr(options, name) for name in names})
    folders = [options.out / bundle.name for bundle in options.bundles]
    sizes = {folder.name: sum(file.stat().st_size for file in folder.iterdir()) for folder in folders}
    print(json.dumps({**about, "bytes": sizes}))
