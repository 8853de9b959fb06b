"""The brain maker: made again from the surfaces, the coarse mesh has the committed bytes."""

from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csgraph

from upt_training.anatomy import tetrahedra
from upt_training.anatomy.__main__ import SPACINGS
from upt_training.anatomy.brain import Anatomy, weld
from upt_training.anatomy.distance import close, inside_mask, signed_distance
from upt_training.anatomy.landmarks import distance_to_callosum, distance_to_polyline
from upt_training.anatomy.mesh_file import mesh_hash, save, tensors

MESHES = Path(__file__).resolve().parents[2] / "onnx" / "meshes"


@pytest.fixture(scope="module")
def coarse():
    return Anatomy().build(SPACINGS[3000])


def test_the_committed_coarse_mesh_is_made_again(coarse, tmp_path):
    path = tmp_path / "brain-coarse.mesh.safetensors"
    assert save(coarse, "brain-coarse", path) == mesh_hash(tensors(coarse))
    assert path.read_bytes() == (MESHES / path.name).read_bytes()


def test_counts_and_quality(coarse):
    assert 2850 <= len(coarse.positions) <= 3160
    assert tetrahedra.components(len(coarse.positions), coarse.tets) == 1
    assert len(np.unique(coarse.tets)) == len(coarse.positions)
    assert tetrahedra.volumes(coarse.positions, coarse.tets).min() > 0
    angles = tetrahedra.dihedral_angles(coarse.positions, coarse.tets)
    assert angles.min() > 10.7
    assert angles.max() < 164.8
    # Both hemispheres of fsaverage, closed by 4 mm, hold a little more than a litre.
    assert 1000e3 < tetrahedra.volumes(coarse.positions, coarse.tets).sum() < 1150e3


def test_boundary_is_manifold_and_a_sphere(coarse):
    surface = coarse.surface
    assert len(tetrahedra.non_manifold_edges(surface)) == 0
    assert len(tetrahedra.non_manifold_nodes(surface)) == 0
    edges = len(np.unique(tetrahedra.edges_of(surface), axis=0))
    assert len(np.unique(surface)) - edges + len(surface) == 2


def test_sets_are_where_they_belong(coarse):
    positions = coarse.positions
    assert distance_to_callosum(positions[coarse.fixed]).max() < 8.0
    domain_nodes = np.unique(coarse.surface[coarse.domain])
    # The left lateral surface, round the Sylvian fissure.
    assert positions[domain_nodes, 0].max() < -20.0
    assert len(tetrahedra.largest_part(coarse.surface[coarse.domain])) == len(coarse.domain)
    assert not np.intersect1d(coarse.supported, coarse.fixed).size
    assert not np.intersect1d(coarse.supported, domain_nodes).size
    assert np.isin(coarse.supported, coarse.surface).all()
    # Both hemispheres lean on the skull.
    assert (positions[coarse.supported, 0] > 20).sum() > 100
    assert (positions[coarse.supported, 0] < -20).sum() > 100


def test_hemispheres_meet_in_fixed_nodes_only(coarse):
    free = ~np.isin(np.arange(len(coarse.positions)), coarse.fixed)
    edges = np.concatenate([coarse.tets[:, [i, j]] for i in range(4) for j in range(i)])
    edges = edges[free[edges].all(axis=1)]
    graph = sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(len(free),) * 2)
    _, part = csgraph.connected_components(graph, directed=False)
    left = np.unique(part[free & (coarse.positions[:, 0] < 0)])
    right = np.unique(part[free & (coarse.positions[:, 0] > 0)])
    assert len(left) and len(right)
    assert not np.intersect1d(left, right).size


def test_weld_joins_near_the_callosum_and_nowhere_else():
    def halves(y, z):
        plane = np.array([[0, y, z], [0, y + 1, z], [0, y, z + 1]], dtype=float)
        left = np.vstack([plane, [[-1, y, z]]])
        right = np.vstack([plane, [[1, y, z]]])
        return (left, np.array([[0, 2, 1, 3]])), (right, np.array([[0, 1, 2, 3]]))

    positions, tets, welded = weld(*halves(-4, 25), 4.5)
    assert len(positions) == 5
    assert welded.sum() == 3
    assert len(tetrahedra.boundary(tets)) == 6
    with pytest.raises(ValueError, match="callosal"):
        weld(*halves(-4, 60), 4.5)


def test_non_manifold_places_are_found():
    edge_touch = np.array([[0, 1, 2, 3], [0, 1, 4, 5]])
    surface = tetrahedra.boundary(edge_touch)
    assert tetrahedra.non_manifold_edges(surface).tolist() == [[0, 1]]
    node_touch = np.array([[0, 1, 2, 3], [0, 4, 5, 6]])
    surface = tetrahedra.boundary(node_touch)
    assert len(tetrahedra.non_manifold_edges(surface)) == 0
    assert tetrahedra.non_manifold_nodes(surface).tolist() == [0]


def test_inside_of_an_octahedron():
    vertices = 5.0 * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=float)
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    origin = np.full(3, -7.25)
    mask = inside_mask(vertices, faces, origin, (16, 16, 16))
    points = origin + np.stack(np.meshgrid(*[np.arange(16.0)] * 3, indexing="ij"), axis=-1)
    assert np.array_equal(mask, np.abs(points).sum(axis=-1) < 5.0)


def test_closing_fills_a_narrow_gap_and_keeps_a_wide_one():
    mask = np.ones((40, 40, 40), dtype=bool)
    mask[:10] = mask[-10:] = mask[:, :10] = mask[:, -10:] = False
    mask[:, :, :5] = mask[:, :, -5:] = False
    narrow, wide = mask.copy(), mask.copy()
    narrow[18:22, :, 10:] = False
    wide[12:28, :, 10:] = False
    assert close(narrow, 4.0)[20, 20, 20]
    assert not close(wide, 4.0)[20, 20, 20]
    assert signed_distance(mask)[20, 20, 20] > 9


def test_distance_to_polyline():
    line = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)])
    points = np.array([(2.0, 1.5), (5.0, 5.0), (-3.0, 4.0)])
    expected = [1.5, np.hypot(1, 2), 5.0]
    assert np.allclose(distance_to_polyline(points, line), expected)
