"""A reduced bundle on a finer mesh of the same body, from a bundle and compliance columns of a coarser one.

At 151,201 nodes the domain has thousands of nodes: their columns are 12 GB and their mutual block 0.2 GB. Here both
come from the coarser mesh. Its columns are interpolated to the fine nodes; each coarse contact node stands for the fine
domain node nearest to it, and the domain's other nodes lend their displacement to the nearest of those (the runtime
takes the mean of all that borrow a column). The mutual block stays the coarse one. Residual modes are interpolated
too, so the correction goes over without fine trajectories.

Norms grow by `s = sqrt(K_fine / K_coarse)` for one and the same field. Modes are divided by it, so that they stay of
length one, and the graph converts: `b_fine = s b_coarse`.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnx
import scipy.sparse
from onnx import helper, numpy_helper
from scipy.spatial import cKDTree

from upt_training.errors import InputError
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.reduced.block_basis import build_block_basis
from upt_training.reduced.columns import Columns, contact_forces, load_columns
from upt_training.reduced.export import listing, write_manifest
from upt_training.reduced.make_prior import check_columns
from upt_training.reduced.patches import sample_forces
from upt_training.reduced.prior import Prior, load_prior, response_in_blocks, save_prior
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.transfer import interpolation

SAMPLES = 768


def standing_nodes(coarse: Mesh, fine: Mesh, contact_nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each coarse contact node a fine domain node of its own: fine nodes `[D]` ascending, and their coarse rows.

    Pairs are taken by distance, nearest first; a coarse node without a free fine node among its eight nearest is left
    out.
    """
    domain = fine.domain_nodes
    count = min(8, len(domain))
    distance, near = cKDTree(fine.positions[domain]).query(coarse.positions[contact_nodes], k=count)
    distance, near = distance.reshape(-1, count), near.reshape(-1, count)
    taken, chosen = np.zeros(len(domain), bool), np.full(len(contact_nodes), -1)
    for pair in np.argsort(distance, axis=None, kind="stable"):
        row, candidate = divmod(int(pair), count)
        if chosen[row] < 0 and not taken[near[row, candidate]]:
            chosen[row] = near[row, candidate]
            taken[chosen[row]] = True
    rows = np.flatnonzero(chosen >= 0)
    nodes = domain[chosen[rows]]
    order = np.argsort(nodes)
    return nodes[order].astype(np.int32), rows[order]


def interpolate_columns(
    columns: Columns, weights: scipy.sparse.csr_matrix, nodes: np.ndarray, rows: np.ndarray, path: Path, fine: Mesh
) -> Columns:
    """Columns of the fine mesh as a memory map at `path`: 7 GB at 151,201 nodes and 1,917 columns, 24 at a time."""
    dofs = (3 * rows[:, None] + np.arange(3)).ravel()
    out = np.memmap(path, np.float32, "w+", shape=(len(dofs), 3 * fine.node_count))
    for at in range(0, len(dofs), 24):
        out[at : at + 24] = interpolate(weights, np.asarray(columns.columns[dofs[at : at + 24]]))
    metadata = {**columns.metadata, "mesh_name": fine.metadata.get("name", ""), "mesh_sha256": fine.sha256}
    return Columns(path, nodes, columns.compliance[np.ix_(dofs, dofs)], out, metadata)


def interpolate(weights: scipy.sparse.csr_matrix, fields: np.ndarray) -> np.ndarray:
    """Whole-mesh fields `[n, 3 K_coarse]` at the fine nodes, `[n, 3 K_fine]`."""
    count = len(fields)
    by_node = fields.reshape(count, -1, 3).transpose(1, 0, 2).reshape(weights.shape[1], -1)
    moved = (weights @ by_node).reshape(-1, count, 3).transpose(1, 0, 2)
    return np.ascontiguousarray(moved, np.float32).reshape(count, -1)


def scaled_graph(graph: onnx.ModelProto, modes: int, scale: float) -> onnx.ModelProto:
    """The correction with `b` and `b_prev` of its state, and its output, in units `scale` times smaller."""
    out = onnx.ModelProto()
    out.CopyFrom(graph)
    width = out.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    factors = np.ones(width, np.float32)
    factors[: 2 * modes] = 1.0 / scale
    for name, value in (("fine_to_coarse", factors), ("coarse_to_fine", np.array(scale, np.float32))):
        out.graph.initializer.append(numpy_helper.from_array(value, name))
    for node in out.graph.node:
        node.input[:] = ["coarse_state" if name == "state" else name for name in node.input]
        node.output[:] = ["coarse_next" if name == "b_next" else name for name in node.output]
    out.graph.node.insert(0, helper.make_node("Mul", ["state", "fine_to_coarse"], ["coarse_state"]))
    out.graph.node.append(helper.make_node("Mul", ["coarse_next", "coarse_to_fine"], ["b_next"]))
    onnx.checker.check_model(out, full_check=True)
    return out


@dataclass
class Refinement:
    """What the command line gives."""

    bundle: Path
    columns: Path
    mesh: Path
    out: Path
    work: Path
    name: str
    tolerance_mm: float = 5e-3
    tables: str = "f16"


def refine(options: Refinement, progress: Callable[[int, int], None] = lambda done, total: None) -> dict:
    """Write the fine bundle; returns its manifest."""
    manifest = json.loads((options.bundle / "bundle.json").read_text())
    if manifest.get("kind") != "reduced":
        raise InputError(f"{options.bundle}/bundle.json: kind is {manifest.get('kind')!r}, expected 'reduced'")
    coarse, fine = load_mesh(options.bundle / "mesh.safetensors"), load_mesh(options.mesh)
    columns, known = load_columns(options.columns), load_prior(options.bundle / manifest["prior"]["file"])
    check_columns(coarse, columns)
    if columns.metadata["boundary"] != manifest["boundary"]:
        raise InputError(f"{options.columns}: boundary {columns.metadata['boundary']!r} differs from the bundle's")
    options.work.mkdir(parents=True, exist_ok=True)
    scale = float(np.sqrt(fine.node_count / coarse.node_count))
    weights = interpolation(coarse, fine)
    held = fine.held_nodes(manifest["boundary"])
    weights = scipy.sparse.diags((~np.isin(np.arange(fine.node_count), held)).astype(np.float32)) @ weights
    nodes, rows = standing_nodes(coarse, fine, columns.contact_nodes)
    nodes, rows = nodes[~np.isin(nodes, held)], rows[~np.isin(nodes, held)]
    file = options.work / "columns.f32"
    moved = interpolate_columns(columns, weights, nodes, rows, file, fine)
    modes = interpolate(weights, known.field(known.residual).reshape(len(known.residual), -1)) / scale

    forces = sample_forces(fine, moved, SAMPLES)
    amplitudes = np.full(len(modes), 0.1 * scale, np.float32)
    basis, info = build_block_basis(fine, moved, forces, modes, amplitudes, options.tolerance_mm, progress=progress)
    dofs = (3 * rows[:, None] + np.arange(3)).ravel()
    prior = Prior(
        moved.contact_nodes,
        moved.compliance,
        basis,
        response_in_blocks(moved.columns, basis),
        basis.project(modes),
        known.force_to_z[dofs],
        known.force_to_p[dofs],
        {key: moved.metadata[key] for key in ("mesh_name", "mesh_sha256", "boundary", "young_pa", "poisson")},
    )
    staging = options.out.with_name(options.out.name + ".new")
    shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir(parents=True)
    graph = scaled_graph(onnx.load(str(options.bundle / "latent.onnx")), manifest["reduced"]["modes"], scale)
    onnx.save(graph, str(staging / "latent.onnx"))
    save_prior(staging / "prior.safetensors", prior, np.float16 if options.tables == "f16" else np.float32)
    fine.save(staging / "mesh.safetensors")
    names = ("latent.onnx", "mesh.safetensors", "prior.safetensors")
    manifest |= {
        "name": options.name,
        "mesh": {"file": "mesh.safetensors", "nodes": fine.node_count, "mesh_sha256": fine.sha256},
        "prior": {"file": "prior.safetensors"},
        "precisions": ["f32"],
        "errors": {},
        "files": {name: listing(staging / name) for name in names},
        "provenance": {
            "refined_from": {"name": manifest["name"], "mesh_sha256": coarse.sha256, "errors": manifest["errors"]},
            "block_basis": info,
            "tables": options.tables,
            "command": "python -m upt_training.reduced refine",
        },
    }
    write_manifest(staging, manifest)
    shutil.rmtree(options.out, ignore_errors=True)
    staging.rename(options.out)
    del moved
    file.unlink()
    return manifest


def exact_error(folder: Path, exact: Columns, mesh: Mesh, samples: int = 24, seed: int = 5) -> dict[str, float]:
    """Error of the bundle's `L(c)` against columns of its own mesh on patches pushed as one by 10 mm, mm.

    `exact` may hold columns of a part of the domain only: patches are drawn there.
    """
    runner = ReducedRunner(folder)
    runner.correct = False
    rng = np.random.default_rng(seed)
    points = mesh.positions[exact.contact_nodes].astype(np.float64)
    square, truth, largest = 0.0, 0.0, 0.0
    for _ in range(samples):
        centre = points[rng.integers(len(points))]
        distance = np.linalg.norm(points - centre, axis=1)
        rows = np.flatnonzero(distance <= np.sqrt(rng.uniform(60.0, 280.0) / np.pi))
        direction = rng.normal(size=3)
        vectors = np.tile(10.0 * direction / np.linalg.norm(direction), (len(rows), 1)).astype(np.float32)
        forces = contact_forces(exact.compliance, rows, vectors).ravel().astype(np.float32)
        dofs = (3 * rows[:, None] + np.arange(3)).ravel()
        field = (forces @ exact.columns[dofs]).reshape(-1, 3)
        field[exact.contact_nodes[rows]] = vectors
        runner.reset()
        error = runner.step(exact.contact_nodes[rows], vectors) - field
        square += float((error.astype(np.float64) ** 2).sum(1).mean()) / samples
        truth += float((field.astype(np.float64) ** 2).sum(1).mean()) / samples
        largest = max(largest, float(np.abs(error).max()))
    return {"rms_mm": square**0.5, "response_rms_mm": truth**0.5, "max_mm": largest}
