"""A small box of tetrahedra for tests: six tetrahedra a cell, held at the bottom, touched on top."""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import numpy as np

from upt_training.mesh_file import Mesh


def box_mesh(cells: tuple[int, int, int] = (6, 5, 4), spacing_mm: float = 10.0, jitter: float = 0.15) -> Mesh:
    """`(nx+1)(ny+1)(nz+1)` nodes; inner nodes are moved by up to `jitter` spacings (seeded)."""
    shape = tuple(c + 1 for c in cells)
    index = np.arange(np.prod(shape)).reshape(shape)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    positions = grid * spacing_mm
    inner = ((grid > 0) & (grid < np.asarray(cells))).all(axis=1)
    move = np.random.default_rng(3).uniform(-jitter, jitter, positions.shape) * spacing_mm
    positions = positions + move * inner[:, None]
    tets = []
    for cell in itertools.product(*(range(c) for c in cells)):
        for order in itertools.permutations(range(3)):
            corner, path = np.asarray(cell), []
            for axis in (None, *order):
                corner = corner + (np.arange(3) == axis) if axis is not None else corner
                path.append(index[tuple(corner)])
            tets.append(path)
    tets = np.asarray(tets)
    edge = positions[tets[:, 1:]] - positions[tets[:, :1]]
    flip = np.linalg.det(edge) < 0
    tets[flip] = tets[flip][:, [0, 2, 1, 3]]
    faces = np.concatenate([tets[:, f] for f in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    surface = faces[np.sort(first[count == 1])]
    height = positions[surface][..., 2]
    domain = np.flatnonzero((height > (cells[2] - 0.01) * spacing_mm).all(axis=1))
    fixed = np.flatnonzero(grid[:, 2] == 0)
    side = np.flatnonzero((grid[:, 2] > 0) & (grid[:, 2] < cells[2]) & (grid[:, 0] == 0))
    return Mesh(
        positions.astype(np.float32),
        tets.astype(np.int32),
        surface.astype(np.int32),
        domain.astype(np.int32),
        fixed.astype(np.int32),
        side.astype(np.int32),
        {"name": "box", "source": "upt_training.box_mesh", "license": "MIT OR Apache-2.0"},
    )


def main(arguments: list[str] | None = None) -> int:
    """`python -m upt_training.box_mesh OUT.mesh.safetensors`: the box as a file, for a first try."""
    parser = argparse.ArgumentParser(prog="python -m upt_training.box_mesh", description=main.__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--cells", type=int, nargs=3, default=(6, 5, 4))
    parser.add_argument("--spacing-mm", type=float, default=10.0)
    options = parser.parse_args(arguments)
    mesh = box_mesh(tuple(options.cells), options.spacing_mm)
    mesh.save(options.out)
    print(f"{options.out}: {mesh.node_count} nodes, {len(mesh.tets)} tets, mesh hash {mesh.sha256[:12]}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
