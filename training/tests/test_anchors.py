"""Decoder anchors: linear fields are reproduced, gaps are not crossed, a bundle's rollout hardly changes."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upt_training.__main__ import main
from upt_training.anchors import edge_lengths, make_anchors
from upt_training.box_mesh import box_mesh
from upt_training.bundle_rollout import BundleRunner

FIXTURES = Path(__file__).parents[2] / "tests/fixtures"


def test_linear_fields_are_reproduced_and_anchors_keep_their_values():
    mesh = box_mesh()
    anchors = make_anchors(mesh, 12.0)
    assert 8 < len(anchors.nodes) < mesh.node_count / 2
    field = mesh.positions @ np.array([[0.3, -1.0], [0.7, 0.2], [-0.4, 0.5]]) + 3.0
    out = anchors.interpolate(field[anchors.nodes])
    assert np.abs(out - field).max() < 0.02 * np.ptp(field)
    np.testing.assert_allclose(out[anchors.nodes], field[anchors.nodes], atol=1e-5)
    np.testing.assert_allclose(anchors.weights.sum(axis=1), 1.0, atol=1e-5)


def test_every_node_is_near_an_anchor_along_the_edges():
    mesh = box_mesh()
    anchors = make_anchors(mesh, 12.0)
    nearest = anchors.nodes[anchors.neighbours[:, 0]]
    assert np.linalg.norm(mesh.positions - mesh.positions[nearest], axis=1).max() <= 12.0
    assert edge_lengths(mesh).nnz > mesh.node_count


def test_a_gap_is_not_crossed():
    one = box_mesh()
    shift = np.array([np.ptp(one.positions[:, 0]) + 0.5, 0, 0], np.float32)
    two = replace(
        one,
        positions=np.concatenate([one.positions, one.positions + shift]),
        tets=np.concatenate([one.tets, one.tets + one.node_count]),
    )
    anchors = make_anchors(two, 12.0)
    side = np.arange(two.node_count) >= one.node_count
    used = anchors.weights != 0
    assert (side[anchors.nodes][anchors.neighbours] == side[:, None])[used].all()


def test_the_command_changes_a_bundle_little_and_refuses_others(tmp_path, capsys):
    bundle = tmp_path / "bundle"
    shutil.copytree(FIXTURES / "tiny-upt-prior", bundle)
    manifest = json.loads((bundle / "bundle.json").read_text())
    del manifest["upt"]["anchors"]
    (bundle / "bundle.json").write_text(json.dumps(manifest))
    nodes = np.setdiff1d(box_mesh().domain_nodes, box_mesh().fixed)[:4]
    push = np.tile(np.float32([0.2, -0.1, -3.0]), (4, 1))
    every = BundleRunner(bundle)
    assert every.anchors is None
    want = every.step(nodes, push)
    assert main(["anchors", str(bundle), "--spacing", "0.1"]) == 0
    assert "210 of 210" in capsys.readouterr().out
    np.testing.assert_allclose(BundleRunner(bundle).step(nodes, push), want, atol=1e-5)
    assert main(["anchors", str(bundle), "--spacing", "12"]) == 0
    got = BundleRunner(bundle).step(nodes, push)
    assert 0 < np.abs(got - want).max() < 0.2 * np.abs(want).max()
    for other, message in (("tiny-upt", "base `prior`"), ("tiny-reduced", "kind `upt`"), ("none", "is missing")):
        assert main(["anchors", str(FIXTURES / other), "--spacing", "5"]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize("settings", ["--spacing -1", "--spacing nan", "--spacing 9 --neighbours 3"])
def test_bad_settings_change_nothing(settings, tmp_path, capsys):
    bundle = tmp_path / "bundle"
    shutil.copytree(FIXTURES / "tiny-upt-prior", bundle)
    before = (bundle / "bundle.json").read_bytes()
    assert main(["anchors", str(bundle), *settings.split()]) == 2
    assert "--spacing" in capsys.readouterr().err
    assert (bundle / "bundle.json").read_bytes() == before
