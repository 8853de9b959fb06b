"""Bundles by name: the organ of the package, and downloads. A folder stands in for the mirror; nothing is fetched."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest
import upt
from upt import bundles

ROOT = Path(__file__).resolve().parents[2]


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


@pytest.fixture
def mirror(tmp_path, monkeypatch) -> Path:
    """Holds `tiny`, whose mesh lies with the body `flesh`."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("UPT_MIRROR", raising=False)
    folder = tmp_path / "mirror"
    shutil.copytree(ROOT / "tests" / "fixtures" / "tiny-reduced", folder / "tiny")
    manifest = json.loads((folder / "tiny" / "bundle.json").read_text())
    (folder / "flesh").mkdir()
    (folder / "tiny" / "mesh.safetensors").rename(folder / "flesh" / "mesh.safetensors")
    manifest["body"] = "flesh"
    (folder / "tiny" / "bundle.json").write_text(json.dumps(manifest))
    return folder


@pytest.mark.parametrize("by_address", [False, True])
def test_a_download_is_complete_and_fetched_once(mirror, by_address):
    wanted = digest(mirror / "tiny" / "bundle.json")
    place = mirror.as_uri() if by_address else mirror
    folder = upt.download("tiny", mirror=place, sha256=wanted)
    assert folder == bundles.downloads() / "tiny" == upt.bundle("tiny")
    manifest = json.loads((folder / "bundle.json").read_text())
    assert {file.name for file in folder.iterdir()} == {"bundle.json", *manifest["files"]}
    assert all(digest(folder / name) == stated["sha256"] for name, stated in manifest["files"].items())
    shutil.rmtree(mirror)
    assert upt.download("tiny", sha256=wanted) == folder


@pytest.mark.parametrize("damage", ["a byte", "a byte more", "no file"])
def test_a_download_that_is_not_what_it_should_be_leaves_nothing(mirror, damage):
    wanted = digest(mirror / "tiny" / "bundle.json")
    file = mirror / "flesh" / "mesh.safetensors"
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content if damage == "a byte" else bytes(content) + b"x")
    if damage == "no file":
        file.unlink()
    with pytest.raises((ValueError, OSError), match=r"mesh\.safetensors"):
        upt.download("tiny", mirror=mirror, sha256=wanted)
    assert [*bundles.downloads().iterdir()] == []


def test_a_download_says_what_it_lacks(mirror, monkeypatch):
    wanted = digest(mirror / "tiny" / "bundle.json")
    with pytest.raises(ValueError, match="UPT_MIRROR"):
        upt.download("tiny", sha256=wanted)
    with pytest.raises(ValueError, match="sha256"):
        upt.download("tiny", mirror=mirror)
    with pytest.raises(ValueError, match="name"):
        upt.download("../tiny", mirror=mirror, sha256=wanted)
    with pytest.raises(ValueError, match=r"bundle\.json: sha256"):
        upt.download("tiny", mirror=mirror, sha256="0" * 64)
    # A manifest that leads out of its folder.
    manifest = json.loads((mirror / "tiny" / "bundle.json").read_text())
    manifest["files"]["../../escaped"] = {"bytes": 1, "sha256": "0" * 64}
    (mirror / "tiny" / "bundle.json").write_text(json.dumps(manifest))
    monkeypatch.setenv("UPT_MIRROR", str(mirror))
    with pytest.raises(ValueError, match="no plain name"):
        upt.download("tiny", sha256=digest(mirror / "tiny" / "bundle.json"))


@pytest.mark.skipif(not bundles.ORGANS.is_dir(), reason="not from a wheel")
def test_the_wheel_knows_the_bundles_of_its_day(mirror, monkeypatch):
    monkeypatch.setenv("UPT_MIRROR", str(ROOT / "onnx"))
    folder = upt.download("brain-fast")  # its body lies with another bundle
    assert digest(folder / "bundle.json") == digest(ROOT / "onnx" / "brain-fast" / "bundle.json")
    with pytest.raises(OSError, match=r"brain-paper"):  # known, and not on this mirror
        upt.download("brain-paper", mirror=mirror)
    assert upt.Model(upt.bundle("liver-coarse")).node_count == 1178
