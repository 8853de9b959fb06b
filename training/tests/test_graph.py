"""Supernodes and radius graph: the fixture shared with Rust, and the properties that the fixture cannot show."""

import json
from pathlib import Path

import numpy as np
from safetensors import safe_open

from upt_training.box_mesh import box_mesh
from upt_training.config import GraphSettings
from upt_training.graph import build_graph, choose_supernodes, node_keys, radius_graph

FIXTURES = Path(__file__).parents[2] / "tests" / "fixtures"


def test_graph_equals_the_shared_fixture():
    mesh = box_mesh()
    with safe_open(str(FIXTURES / "graph.safetensors"), "numpy") as file:
        assert np.array_equal(file.get_tensor("positions"), mesh.positions)
        assert np.array_equal(file.get_tensor("keys_seed7").view(np.uint64), node_keys(mesh.node_count, 7))
        for i, case in enumerate(json.loads(file.metadata()["cases"])):
            graph = build_graph(mesh, GraphSettings(**case))
            for name in ("supernodes", "offsets", "neighbours"):
                assert np.array_equal(file.get_tensor(f"case{i}.{name}"), getattr(graph, name)), (
                    i,
                    name,
                )


def test_splitmix_reference_value():
    # splitmix64(0) of the reference implementation
    assert int(node_keys(1, 0)[0]) == 0xE220A8397B1DCDAF


def test_rows_are_the_nearest_and_hold_the_node_itself():
    p = np.random.default_rng(0).uniform(0, 30, (300, 3)).astype(np.float32)
    supernodes = choose_supernodes(300, 40, 5, np.arange(50), 0.5)
    assert np.isin(supernodes, np.arange(50)).sum() >= 20
    graph = radius_graph(p, supernodes, 9.0, 6)
    for s, node in enumerate(supernodes):
        row = graph.neighbours[graph.offsets[s] : graph.offsets[s + 1]]
        distance = np.linalg.norm(p.astype(np.float64) - p[node], axis=1)
        assert node in row and len(row) <= 6 and (distance[row] <= 9.0).all()
        outside = np.setdiff1d(np.flatnonzero(distance <= 9.0), row)
        assert len(outside) == 0 or distance[outside].min() >= distance[row].max()


def test_self_edge_survives_more_coincident_nodes_than_the_degree():
    p = np.zeros((10, 3), np.float32)
    graph = radius_graph(p, np.array([9]), 1.0, 4)
    assert 9 in graph.neighbours and len(graph.neighbours) == 4
