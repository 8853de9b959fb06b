"""`python -m upt_training.anatomy --nodes 151201 --out brain-fine.mesh.safetensors`"""

import argparse
from pathlib import Path

import numpy as np

from . import tetrahedra
from .brain import Anatomy
from .mesh_file import save

# Lattice spacings, mm, of the three resolutions, chosen for the best elements within the count.
SPACINGS = {3000: 10.32, 21670: 5.1275, 151201: 2.575}
TOLERANCE = 0.01


def find_spacing(anatomy, nodes):
    """Lattice spacing, mm, whose brain has `nodes` nodes within 1 %."""
    spacing = 5.13 * (21671 / nodes) ** (1 / 3)
    for _ in range(8):
        count = len(anatomy.build(spacing).positions)
        print(f"spacing {spacing:.4f} mm: {count} nodes")
        if abs(count / nodes - 1) <= TOLERANCE:
            return spacing
        spacing = round(spacing * (count / nodes) ** (1 / 3), 4)
    raise SystemExit(f"no lattice spacing found for {nodes} nodes; give --spacing")


def describe(brain):
    """Prints counts and quality."""
    positions = brain.positions.astype(np.float32).astype(np.float64)
    angles = tetrahedra.dihedral_angles(positions, brain.tets)
    volumes = tetrahedra.volumes(positions, brain.tets)
    rows = {
        "lattice spacing, mm": brain.spacing,
        "nodes": len(positions),
        "tetrahedra": len(brain.tets),
        "surface faces": len(brain.surface),
        "domain faces": len(brain.domain),
        "fixed nodes": len(brain.fixed),
        "supported nodes": len(brain.supported),
        "components": tetrahedra.components(len(positions), brain.tets),
        "unreferenced nodes": len(positions) - len(np.unique(brain.tets)),
        "non-manifold edges": len(tetrahedra.non_manifold_edges(brain.surface)),
        "non-manifold nodes": len(tetrahedra.non_manifold_nodes(brain.surface)),
        "dihedral angles, degrees": f"{angles.min():.2f} to {angles.max():.2f}",
        "smallest inscribed radius, mm": (f"{tetrahedra.inscribed_radii(positions, brain.tets).min():.4f}"),
        "volume, ml": f"{volumes.sum() / 1000:.1f}",
        "smallest volume, mm3": f"{volumes.min():.4f}",
    }
    for label, value in rows.items():
        print(f"{label:32}{value}")


def main():
    parser = argparse.ArgumentParser(prog="python -m upt_training.anatomy", description=__doc__)
    parser.add_argument("--nodes", type=int, help="node count, met within 1 %% (5 %% for 3000)")
    parser.add_argument("--spacing", type=float, help="lattice spacing, mm, instead of --nodes")
    parser.add_argument("--name", help="mesh name in the metadata; default: the file's")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    if (arguments.nodes is None) == (arguments.spacing is None):
        parser.error("give --nodes or --spacing")
    anatomy = Anatomy()
    spacing = arguments.spacing or SPACINGS.get(arguments.nodes)
    brain = anatomy.build(spacing or find_spacing(anatomy, arguments.nodes))
    name = arguments.name or arguments.out.name.removesuffix(".mesh.safetensors")
    digest = save(brain, name, arguments.out)
    describe(brain)
    print(f"{'mesh hash':32}{digest}")


if __name__ == "__main__":
    main()
