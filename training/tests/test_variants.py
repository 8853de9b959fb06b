"""`variants`: the narrow graphs of a copied bundle give nearly the float32 values, and its manifest lists them."""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from upt_training.__main__ import main

BUNDLE = Path(__file__).parents[2] / "tests/fixtures/tiny-upt"


def outputs(path: Path) -> list[np.ndarray]:
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    random = np.random.default_rng(1)
    feeds = {}
    for entry in session.get_inputs():
        shape = [size if isinstance(size, int) else 12 for size in entry.shape]
        feeds[entry.name] = random.standard_normal(shape).astype(np.float32)
    return session.run(None, feeds)


def test_variants_are_listed_and_close_to_float32(tmp_path):
    out = tmp_path / "narrow"
    assert main(["variants", str(BUNDLE), "--f16", "--int8", "--out", str(out)]) == 0
    manifest = json.loads((out / "bundle.json").read_text())
    assert manifest["precisions"] == ["f16", "f32", "int8"]
    for name, entry in manifest["files"].items():
        data = (out / name).read_bytes()
        assert len(data) == entry["bytes"] and hashlib.sha256(data).hexdigest() == entry["sha256"], name
    plain = outputs(out / "latent.onnx")
    for precision, tolerance in (("f16", 0.02), ("int8", 0.4)):
        for narrow, wide in zip(outputs(out / f"latent.{precision}.onnx"), plain, strict=True):
            difference = np.abs(narrow - wide).max()
            assert 0 < difference < tolerance * np.abs(wide).max(), precision


def test_a_bundle_without_a_whole_step_has_no_narrow_one(tmp_path):
    bundle, out = tmp_path / "bundle", tmp_path / "narrow"
    shutil.copytree(BUNDLE, bundle)
    (bundle / "step.onnx").unlink()
    manifest = json.loads((bundle / "bundle.json").read_text())
    del manifest["files"]["step.onnx"]
    (bundle / "bundle.json").write_text(json.dumps(manifest))
    assert main(["variants", str(bundle), "--f16", "--out", str(out)]) == 0
    narrow = {name for name in json.loads((out / "bundle.json").read_text())["files"] if ".f16." in name}
    assert narrow == {"latent.f16.onnx", "decoder.f16.onnx"} == {path.name for path in out.glob("*.f16.onnx")}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([str(BUNDLE)], "--f16 or --int8"),
        (["/no/such/bundle", "--f16"], "bundle.json: is missing"),
        ([str(BUNDLE.parent / "tiny-reduced"), "--f16"], "kind `reduced`"),
    ],
)
def test_what_cannot_be_narrowed_is_refused(arguments, message, tmp_path, capsys):
    assert main(["variants", *arguments, "--out", str(tmp_path / "new")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
