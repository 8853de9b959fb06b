"""Copies of a mesh with another domain: hash and simulation stay, contact sites and columns lie elsewhere."""

from __future__ import annotations

from dataclasses import replace

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
