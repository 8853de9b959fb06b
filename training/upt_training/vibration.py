"""Free vibration: linear elasticity after a release (docs/reference/formats.md, `vibration.safetensors`).

While in contact the response is static, `L(c)`. At a release the held, damped, linear-elastic body swings:
`M u'' + alpha M u' + K u = 0`. Its eigenmodes `K phi_k = omega_k² M phi_k` decouple it, and each is advanced over a
step exactly. No number here is learned: mesh, material and step decide. Lengths mm, masses kg, forces mN.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
from safetensors.numpy import save_file
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from upt_training.dataset import map_safetensors
from upt_training.errors import InputError
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.prior_table import PriorTable

MATERIAL = {"young_pa": 3000.0, "poisson": 0.49, "density_kg_m3": 1000.0}
LEAF = 64  # nodes of a part that the elimination order leaves as it is


def stiffness(mesh: Mesh, material: dict) -> sparse.csc_matrix:
    """Small-strain stiffness on linear tetrahedra, `[3K, 3K]`, mN/mm, dof `3 * node + axis`."""
    young, poisson = material["young_pa"], material["poisson"]
    mu, lam = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    gradients, volume = _gradients(mesh)
    outer = np.einsum("tai,tbj->taibj", gradients, gradients)
    element = lam * outer + mu * outer.transpose(0, 1, 4, 3, 2)
    inner = np.einsum("tai,tbi->tab", gradients, gradients)
    for axis in range(3):
        element[:, :, axis, :, axis] += mu * inner
    factor = mesh.stiffness.astype(np.float64) if len(mesh.stiffness) else np.ones(len(volume))
    element *= 1e-3 * (factor * volume)[:, None, None, None, None]  # Pa mm = 1e-3 mN/mm
    dof = (3 * np.asarray(mesh.tets, np.int64)[:, :, None] + np.arange(3)).reshape(-1, 12)
    rows, columns = np.repeat(dof, 12, axis=1).ravel(), np.tile(dof, (1, 12)).ravel()
    return sparse.csc_matrix((element.ravel(), (rows, columns)), shape=(3 * mesh.node_count,) * 2)


def _gradients(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Shape gradients `[T, 4, 3]` 1/mm and volumes `[T]` mm³."""
    corner = mesh.positions[mesh.tets].astype(np.float64)
    edge = corner[:, 1:] - corner[:, :1]
    inner = np.linalg.inv(edge).transpose(0, 2, 1)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1), np.linalg.det(edge) / 6.0


def lumped_mass(mesh: Mesh, density_kg_m3: float) -> np.ndarray:
    """A quarter of each tetrahedron's mass at its corners, `[K]` kg; a region may have a density of its own."""
    volume = _gradients(mesh)[1]
    out = np.zeros(mesh.node_count)
    mass = 1e-9 * volume * mesh.density(density_kg_m3)
    np.add.at(out, np.asarray(mesh.tets).ravel(), np.repeat(mass / 4.0, 4))
    return out


def elimination_order(positions: np.ndarray, neighbours: sparse.csr_matrix) -> np.ndarray:
    """Nested dissection by coordinate bisection: parts first, the nodes between them last (little fill)."""

    def order(nodes: np.ndarray) -> list[np.ndarray]:
        if len(nodes) <= LEAF:
            return [nodes]
        x = positions[nodes]
        by = nodes[np.argsort(x[:, np.argmax(np.ptp(x, axis=0))], kind="stable")]
        left, right = by[: len(by) // 2], by[len(by) // 2 :]
        mark = np.zeros(len(positions), np.int8)
        mark[right] = 1
        between = np.asarray(neighbours[left] @ mark).ravel() > 0
        return [*order(left[~between]), *order(right), left[between]]

    return np.concatenate(order(np.arange(len(positions))))


def eigenmodes(mesh: Mesh, boundary: str, material: dict, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The `count` lowest: angular frequencies `[m]` rad/s, ascending, and mass-normalised modes `[m, 3K]`."""
    free = np.ones(mesh.node_count, bool)
    free[mesh.held_nodes(boundary)] = False
    pairs = np.asarray(mesh.tets, np.int64)[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)
    graph = sparse.csr_matrix((np.ones(len(pairs), np.int8), pairs.T), shape=(mesh.node_count,) * 2)
    graph.data[:] = 1
    order = elimination_order(mesh.positions.astype(np.float64), (graph + graph.T).tocsr())
    nodes = order[free[order]]
    if 3 * len(nodes) <= count + 1:
        raise InputError(f"{count} modes asked of a mesh with {3 * len(nodes)} free degrees of freedom; use fewer")
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    matrix = stiffness(mesh, material)[dofs][:, dofs].tocsc()
    mass = np.repeat(lumped_mass(mesh, material["density_kg_m3"])[nodes], 3)  # kg mm/s² = mN
    factor = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(matrix.shape, factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(len(dofs))
    squared, vectors = eigsh(matrix, count, sparse.diags(mass).tocsc(), sigma=0.0, OPinv=inverse, v0=start)
    rank = np.argsort(squared)
    modes = np.zeros((count, 3 * mesh.node_count))
    modes[:, dofs] = vectors[:, rank].T
    return np.sqrt(squared[rank]), modes


def read_modes(path: Path, mesh: Mesh, boundary: str, material: dict) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and modes of a file of `upt modes`; refuses one of another mesh, boundary or material."""
    tensors, metadata = map_safetensors(path)
    for name, wanted in {"mesh_sha256": mesh.sha256, "boundary": boundary, **material}.items():
        found = metadata.get(name, "nothing")
        if (found != wanted) if isinstance(wanted, str) else (float(found) != wanted):
            raise InputError(f"{path}: {name} is {found}, not {wanted}; make the file again with `upt modes`")
    return np.asarray(tensors["frequency"], np.float64), np.asarray(tensors["modes"], np.float64)


def make_vibration(
    mesh: Mesh, prior: PriorTable, material: dict, frequency: np.ndarray, modes: np.ndarray
) -> tuple[dict, float]:
    """The tensors of `vibration.safetensors`, and the part of the modes' squared norm that the bases cannot hold."""
    mass = np.repeat(lumped_mass(mesh, material["density_kg_m3"]), 3)
    size = np.abs(modes).max(axis=1, keepdims=True)  # modes of largest component 1: amplitudes are mm
    kept = prior.project(modes / size)
    force_to_mode = prior.response_q @ prior.project(modes * mass * size).T
    lost = 1.0 - float((kept**2).sum() / ((modes / size) ** 2).sum())
    tensors = {"frequency": frequency, "modes": kept, "force_to_mode": force_to_mode}
    return {k: np.ascontiguousarray(v, np.float32) for k, v in tensors.items()}, lost


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m upt_training.vibration", description=__doc__)
    parser.add_argument("--mesh", type=Path, required=True)
    parser.add_argument("--prior", type=Path, required=True, help="prior.safetensors of the mesh")
    parser.add_argument("--boundary", default="fixed", choices=["fixed", "supported"])
    parser.add_argument("--modes", type=int, default=64)
    parser.add_argument(
        "--natural", type=Path, help="file of `upt modes`: for meshes that SciPy's factorisation has no memory for"
    )
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    try:
        mesh = load_mesh(options.mesh)
        prior = PriorTable(options.prior, mesh.node_count)
        if options.natural:
            frequency, modes = read_modes(options.natural, mesh, options.boundary, MATERIAL)
        else:
            frequency, modes = eigenmodes(mesh, options.boundary, MATERIAL, options.modes)
        tensors, lost = make_vibration(mesh, prior, MATERIAL, frequency, modes)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    partial = options.out.with_suffix(".partial")
    save_file(tensors, str(partial))
    partial.chmod(0o644)
    partial.rename(options.out)
    hertz = tensors["frequency"] / (2 * np.pi)
    print(json.dumps({"file": str(options.out), "modes": len(hertz), "hertz": [hertz[0], hertz[-1]],
                      "lost_in_block_coordinates": lost}, default=float))  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
