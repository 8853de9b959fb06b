"""What a manifest says of itself: its digest, what it requires, where the network comes to rest."""

import hashlib
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from upt_training.__main__ import main
from upt_training.bundle_folder import read_manifest, seal, write_manifest
from upt_training.bundle_rollout import BundleRunner
from upt_training.rest import rest_displacement

ROOT = Path(__file__).parents[2]
BUNDLES = sorted(path.parent for path in [*ROOT.glob("onnx/*/bundle.json"), *ROOT.glob("tests/fixtures/*/bundle.json")])


def digest_of(folder: Path) -> tuple[str, str]:
    """As stated, and of the text with zeros in its place."""
    text = (folder / "bundle.json").read_text(encoding="utf-8")
    stated = json.loads(text)["manifest_sha256"]
    return stated, hashlib.sha256(text.replace(stated, "0" * 64).encode()).hexdigest()


@pytest.mark.parametrize("bundle", BUNDLES, ids=lambda path: path.name)
def test_committed_manifests_are_sealed_and_say_what_they_require(bundle):
    stated, found = digest_of(bundle)
    assert stated == found and re.fullmatch("[0-9a-f]{64}", stated)
    manifest = read_manifest(bundle)
    prior = manifest.get("prior", {})
    parts = {"anchors": manifest.get("upt", {}), "corrections": manifest, "release": prior, "vibration": prior}
    needed = [name for name, entry in parts.items() if name in entry]
    if manifest["kind"] == "reduced" and "reduced" not in manifest:
        needed.append("unlearned")
    assert manifest.get("requires", []) == sorted(needed)


def test_a_sealed_manifest_keeps_its_lines_and_a_change_shows(tmp_path):
    folder = tmp_path / "bundle"
    shutil.copytree(ROOT / "tests/fixtures/tiny-upt-prior", folder)
    file = folder / "bundle.json"
    before = file.read_text(encoding="utf-8")
    assert main(["seal", str(folder)]) == 0
    assert file.read_text(encoding="utf-8") == before
    file.write_text(before.replace('"max_sites": 1', '"max_sites": 2'), encoding="utf-8")
    assert len(set(digest_of(folder))) == 2
    assert main(["seal", str(folder)]) == 0
    assert len(set(digest_of(folder))) == 1
    changed = set(file.read_text(encoding="utf-8").splitlines()) ^ set(before.splitlines())
    assert len(changed) == 4  # the field and the digest, before and after


def test_what_the_exporter_writes_is_sealed(tmp_path):
    folder = tmp_path / "bundle"
    folder.mkdir()
    (folder / "anchors.safetensors").write_bytes(b"x")
    write_manifest(folder, {"upt": {"anchors": "anchors.safetensors"}, "manifest_sha256": "old", "requires": ["old"]})
    stated, found = digest_of(folder)
    assert stated == found and read_manifest(folder)["requires"] == ["anchors"]
    seal(folder, {"rest_displacement_mm": 0.5})
    seal(folder, {"rest_displacement_mm": None})
    assert digest_of(folder) == (stated, found)


def test_rest_is_where_free_motion_from_a_push_ends_too():
    bundle = ROOT / "onnx/brain-coarse"
    stated = read_manifest(bundle)["rest_displacement_mm"]
    found = rest_displacement(bundle)
    assert found <= stated <= found + 1e-3
    runner = BundleRunner(bundle)
    nodes = runner.mesh.domain_nodes[:20]
    runner.step(nodes, np.full((20, 3), 1.5, np.float32))
    for _ in range(60):
        u = runner.step(nodes[:0], np.zeros((0, 3), np.float32))
    assert abs(np.linalg.norm(u, axis=1).max() - found) < 2e-3
