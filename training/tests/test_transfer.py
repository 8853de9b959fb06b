"""The same weights on another mesh: equal to an export there, and refusals that leave nothing behind."""

import json
from pathlib import Path

import numpy as np
from reduced_phantom import write_columns
from safetensors.numpy import save_file

from upt_training import vibration
from upt_training.__main__ import main
from upt_training.box_mesh import box_mesh
from upt_training.bundle_rollout import BundleRunner
from upt_training.reduced.make_prior import make_prior
from upt_training.reduced.prior import save_prior

FIXTURES = Path(__file__).parents[2] / "tests/fixtures"


def test_a_bundle_moves_to_a_finer_mesh_of_the_same_body(tmp_path, capsys):
    fine = box_mesh(cells=(9, 8, 6), spacing_mm=6.5)
    fine.save(tmp_path / "fine.mesh.safetensors")
    prior, _ = make_prior(fine, write_columns(fine, tmp_path / "columns.safetensors"))
    save_prior(tmp_path / "prior.safetensors", prior, np.float32)
    bundle, out = FIXTURES / "tiny-upt-prior", tmp_path / "moved"
    arguments = ["transfer", str(bundle), "--mesh", str(tmp_path / "fine.mesh.safetensors"), "--out", str(out)]
    assert main(arguments) == 2
    assert "--prior" in capsys.readouterr().err
    arguments += ["--prior", str(tmp_path / "prior.safetensors")]
    if "vibration" in json.loads((bundle / "bundle.json").read_text())["prior"]:
        assert main(arguments) == 2
        assert "--vibration" in capsys.readouterr().err
        command = ["--mesh", arguments[3], "--prior", arguments[7], "--modes", "8"]
        assert vibration.main([*command, "--out", str(tmp_path / "vibration.safetensors")]) == 0
        arguments += ["--vibration", str(tmp_path / "vibration.safetensors")]
    assert not out.exists()
    assert main(arguments) == 0
    manifest = json.loads((out / "bundle.json").read_text())
    assert manifest["mesh"]["mesh_sha256"] == fine.sha256
    assert manifest["errors"] == {} and "anchors" not in manifest["upt"]

    # The linear response is exact there and the correction is a small network's: the push is met, the held side rests.
    runner = BundleRunner(out)
    nodes = np.setdiff1d(fine.domain_nodes, fine.fixed)[:6]
    push = np.tile(np.float32([0.0, 0.0, -2.0]), (6, 1))
    field = runner.step(nodes, push)
    np.testing.assert_allclose(field[nodes], push, atol=1e-6)
    assert np.abs(field[fine.fixed]).max() == 0.0
    assert np.isfinite(field).all() and np.abs(field).max() < 6.0
    old = json.loads((bundle / "bundle.json").read_text())
    kept = [name for name in old["files"] if name.endswith(".onnx") or name == old["upt"]["weights"]]
    assert all(manifest["files"][name] == old["files"][name] for name in kept)


def test_tables_of_another_mesh_and_reduced_bundles_are_refused(tmp_path, capsys):
    box_mesh(cells=(4, 4, 3)).save(tmp_path / "other.mesh.safetensors")
    bundle = FIXTURES / "tiny-upt-prior"
    arguments = ["--mesh", str(tmp_path / "other.mesh.safetensors"), "--out", str(tmp_path / "out")]
    tables = ["--prior", str(bundle / "prior.safetensors")]
    save_file({"frequency": np.ones(2, np.float32)}, str(tmp_path / "vibration.safetensors"))
    tables += ["--vibration", str(tmp_path / "vibration.safetensors")]
    assert main(["transfer", str(bundle), *arguments, *tables]) == 2
    assert "made for 210 nodes, the mesh has" in capsys.readouterr().err
    assert main(["transfer", str(FIXTURES / "tiny-reduced"), *arguments, *tables]) == 2
    assert "only `upt` weights" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
