"""A box with a made-up law for tests of reduced models: compliance columns from a dense inverse, and trajectories."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from upt_training.mesh_file import Mesh
from upt_training.reduced.columns import Columns, contact_forces, load_columns

FRAMES = 41


def dense_stiffness(mesh: Mesh, young_pa: float = 3000.0, poisson: float = 0.49) -> np.ndarray:
    """Stiffness `[3K,3K]` of linear tets in mN/mm, element by element as `B^T D B V` (Voigt notation)."""
    young = young_pa * 1e-3
    mu, lam = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    elastic = np.diag([2 * mu] * 3 + [mu] * 3)
    elastic[:3, :3] += lam
    out = np.zeros((3 * mesh.node_count,) * 2)
    for tet in mesh.tets:
        corner = mesh.positions[tet].astype(np.float64)
        edges = corner[1:] - corner[0]
        gradient = np.linalg.inv(edges).T
        gradient = np.concatenate([-gradient.sum(0, keepdims=True), gradient])
        strain = np.zeros((6, 12))
        for node, (x, y, z) in enumerate(gradient):
            strain[:, 3 * node : 3 * node + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
        dofs = (3 * tet[:, None] + np.arange(3)).ravel()
        out[np.ix_(dofs, dofs)] += strain.T @ elastic @ strain * (np.linalg.det(edges) / 6)
    return out


def write_columns(mesh: Mesh, path: Path) -> Columns:
    """The file that `upt prior` writes, from a dense inverse."""
    stiffness = dense_stiffness(mesh)
    free = np.setdiff1d(np.arange(mesh.node_count), mesh.fixed)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    full = np.zeros_like(stiffness)
    full[np.ix_(dofs, dofs)] = np.linalg.inv(stiffness[np.ix_(dofs, dofs)])
    nodes = np.setdiff1d(mesh.domain_nodes, mesh.fixed)
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    tensors = {
        "columns": full[rows].astype(np.float32),
        "compliance": full[np.ix_(rows, rows)].astype(np.float32),
        "contact_nodes": nodes.astype(np.int32),
    }
    metadata = {"mesh_name": "box", "mesh_sha256": mesh.sha256, "boundary": "fixed"}
    save_file(tensors, str(path), metadata={**metadata, "young_pa": "3000", "poisson": "0.49"})
    return load_columns(path)


def write_dataset(mesh: Mesh, columns: Columns, folder: Path, count: int, frames: int = FRAMES, tool: str = "") -> None:
    """Trajectories with a made-up law: the residual is quadratic in `L` and decays after release.

    `frames`, at least 23, cuts them off in their free motion; `tool` is the scheme in place of 1 to 4.
    """
    folder.mkdir()
    rng = np.random.default_rng(0)
    points = mesh.positions[columns.contact_nodes]
    cases = []
    for index in range(count):
        seed = rng.integers(len(points))
        rows = np.sort(np.argsort(np.linalg.norm(points - points[seed], axis=1), kind="stable")[:4])
        direction = np.array([*rng.normal(size=2) * 0.3, -1.0])
        push = np.sin(np.pi * np.arange(FRAMES) / 30.0)[:, None, None] * direction * rng.uniform(2, 5)
        push = np.tile(push, (1, 4, 1)).astype(np.float32)
        push[0] = push[22:] = 0.0
        forces = np.zeros((FRAMES, len(points), 3))
        forces[:, rows] = contact_forces(columns.compliance, rows, push)
        linear = forces.reshape(FRAMES, -1) @ np.asarray(columns.columns)
        u = np.zeros_like(linear)
        residual = np.zeros(linear.shape[1])
        for t in range(1, FRAMES):
            if t < 22:
                residual = 0.5 * residual + 0.05 * linear[t] * np.abs(linear[t])
                dofs = (3 * columns.contact_nodes[rows][:, None] + np.arange(3)).ravel()
                residual[dofs] = 0.0
            else:
                residual = 0.75 * (residual + linear[t - 1])
            u[t] = linear[t] + residual
        counts = np.where(np.arange(FRAMES) == 0, 0, np.where(np.arange(FRAMES) < 22, 4, 0))
        tensors = {
            "displacement": u.reshape(FRAMES, -1, 3)[:frames].astype(np.float32),
            "contact_offsets": np.concatenate([[0], np.cumsum(counts[:frames])]).astype(np.int32),
            "contact_nodes": np.tile(columns.contact_nodes[rows], 21).astype(np.int32),
            "contact_vectors": push[1:22].reshape(-1, 3),
        }
        name = f"case-{index:05d}.trajectory.safetensors"
        metadata = {"mesh_sha256": mesh.sha256, "site": "[0,0,0]"}
        save_file(tensors, str(folder / name), metadata=metadata)
        split = "test" if (index // 4) % 5 == 4 else "train"
        scheme = tool or str(index % 4 + 1)
        cases.append({"index": index, "file": name, "scheme": scheme, "split": split, "status": "done"})
    (folder / "manifest.json").write_text(json.dumps({"cases": cases}))


def write_statics(mesh: Mesh, columns: Columns, folder: Path, count: int) -> None:
    """Fixed points of the same law, four sites of two depths a case; the second case lacks its last equilibrium."""
    folder.mkdir()
    rng = np.random.default_rng(7)
    points = mesh.positions[columns.contact_nodes]
    cases = []
    for index in range(count):
        fields, nodes, vectors = [np.zeros((1, mesh.node_count, 3))], [], []
        for depth in [part for _ in range(4) for part in (0.5, 1.0)]:
            if depth == 0.5:
                seed, direction = rng.integers(len(points)), np.array([*rng.normal(size=2) * 0.3, -6.0])
            rows = np.sort(np.argsort(np.linalg.norm(points - points[seed], axis=1), kind="stable")[:4])
            push = np.tile(depth * direction, (4, 1))
            forces = np.zeros((len(points), 3))
            forces[rows] = contact_forces(columns.compliance, rows, push)
            linear = forces.reshape(1, -1) @ np.asarray(columns.columns)
            residual = 0.1 * linear * np.abs(linear)
            residual[:, (3 * columns.contact_nodes[rows][:, None] + np.arange(3)).ravel()] = 0.0
            fields.append((linear + residual).reshape(1, -1, 3))
            nodes.append(columns.contact_nodes[rows])
            vectors.append(push)
        kept = 8 - (index == 1)
        tensors = {
            "displacement": np.concatenate(fields[: kept + 1]).astype(np.float32),
            "contact_offsets": np.concatenate([[0], 4 * np.arange(kept + 1)]).astype(np.int32),
            "contact_nodes": np.concatenate(nodes[:kept]).astype(np.int32),
            "contact_vectors": np.concatenate(vectors[:kept]).astype(np.float32),
        }
        name = f"case-{index:05d}.trajectory.safetensors"
        save_file(tensors, str(folder / name), metadata={"mesh_sha256": mesh.sha256, "site": "[0,0,0]"})
        cases.append({"index": index, "file": name, "scheme": "static", "split": "train", "status": "done"})
    (folder / "manifest.json").write_text(json.dumps({"cases": cases}))
