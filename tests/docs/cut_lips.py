"""How far the lips of a slit pass through each other: a figure of docs/guide/cutting.md.

    python tests/docs/cut_lips.py

A slit of 30 x 10 mm; two balls of 4 mm press 3 mm deep on either side of it and go 5 mm towards each other. Pairs of
vertices that were one point of the tissue say how far one lip has come into the other. Nothing is told of contact
between lips, to the library or to the reference solver: both let them pass.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import upt

ROOT = Path(__file__).resolve().parents[2]


def unit(vector: np.ndarray) -> np.ndarray:
    """Of length 1."""
    return vector / np.linalg.norm(vector)


def overlap(bundle: Path) -> np.ndarray:
    """Of each pair, mm: above 0 where the lips have passed each other."""
    model = upt.Model(bundle)
    scene = model.scene(corrections=10)
    rest, domain = model.positions.astype(float), model.domain_nodes
    site = rest[domain[np.argmin(np.linalg.norm(rest[domain] - rest[domain].mean(axis=0), axis=1))]]
    near = rest[model.domain_faces]
    near = near[np.linalg.norm(near.mean(axis=1) - site, axis=1) < 15]
    normal = unit(np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]).sum(axis=0))
    along = unit(np.cross(normal, [0.0, 0.0, 1.0]))
    across = np.cross(along, normal)
    ends = site + 15 * np.array([[-1.0], [1.0]]) * along
    scene.cut([ends + height * normal for height in (8.0, -10.0)])
    surface = scene.surface()
    at, lips = surface.rest.astype(float), surface.triangles[surface.inside]
    outward = np.cross(at[lips[:, 1]] - at[lips[:, 0]], at[lips[:, 2]] - at[lips[:, 0]]) @ across
    sides = np.unique(lips[outward < 0]), np.unique(lips[outward > 0])
    first, other = np.nonzero(np.linalg.norm(at[sides[0]][:, None] - at[sides[1]], axis=2) < 1e-3)
    first, other = sides[0][first], sides[1][other]
    for step in range(40):
        apart = 9 - 5 * np.interp(step, [14, 30], [0, 1])
        height = 4 - np.interp(step, [2, 12], [-2, 3])
        places = [site + side * apart * across + height * normal for side in (-1, 1)]
        scene.step([upt.Instrument.sphere(4.0, position=place) for place in places])
    now = scene.surface_positions().astype(float)
    return ((now[other] - now[first]) @ across)[first != other]


def main() -> None:
    """A line a bundle."""
    for name in ("liver-coarse", "brain-coarse-reduced", "brain"):
        passed = overlap(ROOT / "onnx" / name)
        print(
            f"{name}: {len(passed)} pairs, past each other by {passed.mean():.1f} mm in the mean, "
            f"{passed.max():.1f} at most"
        )


if __name__ == "__main__":
    main()
