"""Copies of a mesh with another domain: hash and simulation stay, contact sites and columns lie elsewhere."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from upt_training.errors import InputError
from upt_training.mesh_file import Mesh


def beside_domain(mesh: Mesh, reach_mm: float) -> Mesh:
    """The free surface around the domain: faces that touch none of its nodes, at most `reach_mm` from it."""
    inside = mesh.domain_nodes
    centre = mesh.positions[mesh.surface].mean(axis=1)
    distance, _ = cKDTree(mesh.positions[inside]).query(centre)
    outside = ~np.isin(mesh.surface, np.union1d(inside, mesh.fixed)).any(axis=1)
    faces = np.flatnonzero(outside & (distance <= reach_mm)).astype(np.int32)
    if not len(faces):
        raise InputError(f"no free face within {reach_mm} mm of the domain; raise --beside")
    return replace(mesh, domain=faces)


def patches_of_domain(mesh: Mesh, count: int, radius_mm: float = 9.5, seed: int = 3) -> Mesh:
    """`count` patches of the domain, far from one another: a sample of its compliance columns at a part of the cost."""
    centre = mesh.positions[mesh.surface[mesh.domain]].mean(axis=1)
    picked = [int(np.random.default_rng(seed).integers(len(centre)))]
    while len(picked) < count:
        distance, _ = cKDTree(centre[picked]).query(centre)
        picked.append(int(distance.argmax()))
    distance, _ = cKDTree(centre[picked]).query(centre)
    return replace(mesh, domain=mesh.domain[distance <= radius_mm])


def worst_of_domain(mesh: Mesh, evaluation: Path, share: float = 0.25, radius_mm: float = 15.0) -> Mesh:
    """The domain around the sites at which a bundle errs most: more data is worth most there.

    `evaluation`: what `python -m upt_training evaluate` wrote for cases that may decide about training data, thus not
    for held-out ones. The `share` of its cases with the largest error count.
    """
    try:
        cases = json.loads(Path(evaluation).read_text(encoding="utf-8"))["cases"]
        rows = sorted((-case["bundle"]["mse_mm2"], case["site"]) for case in cases if case["site"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{evaluation}: not an evaluation with sites ({error}); write it with `evaluate`") from error
    if not rows or not 0.0 < share <= 1.0:
        raise InputError(
            f"{evaluation}: {len(rows)} cases with a site, share {share}: need a case, and a share in (0, 1]"
        )
    sites = np.array([site for _, site in rows[: max(1, round(share * len(rows)))]])
    centre = mesh.positions[mesh.surface[mesh.domain]].mean(axis=1)
    distance, _ = cKDTree(sites).query(centre)
    faces = mesh.domain[distance <= radius_mm]
    if not len(faces):
        raise InputError(
            f"{evaluation}: no face of the domain is within {radius_mm} mm of its worst sites; another mesh?"
        )
    return replace(mesh, domain=faces)
