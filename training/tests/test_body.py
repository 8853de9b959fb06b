"""A bundle that shares its body with others: what its folder lacks lies in the one beside it."""

import shutil
from pathlib import Path

import numpy as np

from upt_training.bundle_folder import copy_whole, file_of, read_manifest, write_manifest
from upt_training.bundle_rollout import BundleRunner
from upt_training.variants import make_variants

TINY = Path(__file__).parents[2] / "tests/fixtures/tiny-upt-prior"
SHARED = ("mesh.safetensors", "prior.safetensors")


def test_readers_take_from_the_body_what_a_bundle_lacks(tmp_path):
    net, tissue = tmp_path / "net", tmp_path / "tissue"
    shutil.copytree(TINY, net)
    tissue.mkdir()
    for name in SHARED:
        (net / name).rename(tissue / name)
    manifest = read_manifest(net) | {"body": "tissue"}
    listed = dict(manifest["files"])
    write_manifest(net, manifest)
    # What the body holds stays listed.
    assert read_manifest(net)["files"] == listed
    assert file_of(net, manifest, SHARED[0]) == tissue / SHARED[0]

    def step(bundle):
        runner = BundleRunner(bundle)
        nodes = runner.mesh.domain_nodes[:4]
        return runner.step(nodes, np.full((4, 3), 0.5, np.float32))

    assert np.array_equal(step(net), step(TINY))

    whole = tmp_path / "whole"
    whole.mkdir()
    copy_whole(net, manifest, whole)
    assert "body" not in manifest and {path.name for path in whole.iterdir()} == {path.name for path in TINY.iterdir()}
    make_variants(net, tmp_path / "narrow", ["f16"])
    assert "body" not in read_manifest(tmp_path / "narrow")
    assert np.array_equal(step(tmp_path / "narrow"), step(TINY))
