"""Export: the bundle's graphs equal the PyTorch model and the unfactored original; the manifest's hashes are right."""

import hashlib
import json
import shutil

import numpy as np
import onnxruntime
import pytest
import torch
from conftest import CONFIGS
from safetensors.numpy import load_file

from upt_training import onnx_graph
from upt_training.__main__ import main
from upt_training.bundle import TOLERANCE
from upt_training.bundle_folder import read_manifest, seal, write_manifest
from upt_training.bundle_rollout import BundleRunner
from upt_training.config import load_settings
from upt_training.dataset import open_dataset, open_trajectory
from upt_training.export import load_model
from upt_training.mesh_file import load_mesh
from upt_training.random_bundle import main as write_random
from upt_training.run import make_trainer


@pytest.fixture(scope="module")
def bundle(committed, data, mesh_path, tmp_path_factory):
    out = tmp_path_factory.mktemp("bundle") / "tiny"
    code = main(["export", str(committed), "--out", str(out), "--mesh", str(mesh_path), "--data", str(data),
                 "--step", "--paper-split", "--int8", "--f16"])  # fmt: skip
    assert code == 0
    return out


def test_self_check_and_hashes(bundle):
    manifest = json.loads((bundle / "bundle.json").read_text())
    check = manifest["provenance"]["export_check"]
    assert set(check) == {
        "onnxruntime_vs_pytorch", "unfactored_vs_pytorch", "step_vs_pytorch", "paper_split_vs_pytorch",
    }  # fmt: skip
    assert all(0 <= v < TOLERANCE for v in check.values())
    for name, entry in manifest["files"].items():
        data = (bundle / name).read_bytes()
        assert len(data) == entry["bytes"] and hashlib.sha256(data).hexdigest() == entry["sha256"]


def test_bundle_rollout_equals_the_training_rollout(bundle, committed, data, mesh_path):
    mesh = load_mesh(mesh_path)
    trainer = make_trainer(load_settings(committed / "config.toml"), data, mesh, None, committed, "cpu")
    trainer.start_from(committed / "best.pt")
    trainer.model.eval()
    runner = BundleRunner(bundle)
    case = open_dataset(data, mesh).select("test")[0]
    trajectory = open_trajectory(case.path, mesh)
    state, tables = trainer.stepper.rest(1), trainer.stepper.tables()
    with torch.no_grad():
        for t in range(1, trajectory.frame_count):
            nodes, vectors = trajectory.contact(t)
            c, contact = torch.zeros(1, mesh.node_count, 3), torch.zeros(1, mesh.node_count, 1)
            c[0, nodes], contact[0, nodes] = torch.from_numpy(np.array(vectors)), 1.0
            state = trainer.stepper.step(state, {"c": c, "contact": contact}, tables)
            found = runner.step(nodes, vectors)
            assert np.abs(found - state.u[0].numpy()).max() < 1e-4 * max(1.0, np.abs(found).max())
    assert np.abs(found).max() > 0.05


def test_kernel_weights_equal_the_graphs(bundle):
    """encoder.onnx must be the low-rank update that weights.safetensors describes."""
    runner, weights = BundleRunner(bundle), load_file(str(bundle / "weights.safetensors"))
    x = np.random.default_rng(0).standard_normal((50, 10)).astype(np.float32)
    d = weights["encoder.source"].shape[0]
    zero = np.zeros((50, d), np.float32)
    source, target = runner.session.encoder.run(None, {"features": x, "source_table": zero, "target_table": zero})
    assert np.abs(source - x @ weights["encoder.source"].T).max() < 1e-5 * np.abs(source).max()
    assert np.abs(target - x @ weights["encoder.target"].T).max() < 1e-5 * np.abs(target).max()


def test_any_subset_decodes_alone(bundle):
    runner = BundleRunner(bundle)
    features = np.random.default_rng(1).standard_normal((runner.mesh.node_count, 10)).astype(np.float32)
    keys, values = runner.session.keys_values(features)
    subset = np.array([3, 77, 140])
    whole, alone = runner.session.decode(keys, values), runner.session.decode(keys, values, subset)
    assert np.abs(whole[subset] - alone).max() < 1e-6 * np.abs(whole).max()


def test_evaluate_reports_the_papers_metrics(bundle, data, tmp_path):
    results = {}
    for precision in ("f32", "f16", "int8"):
        out = tmp_path / f"{precision}.json"
        code = main(
            [
                "evaluate",
                str(bundle),
                "--data",
                str(data),
                "--precision",
                precision,
                "--out",
                str(out),
            ]
        )
        assert code == 0
        results[precision] = json.loads(out.read_text())
    table = results["f32"]["all"]
    assert set(table) == {"bundle", "zero"}
    assert set(table["bundle"]) == {"mse_mm2", "max_mm", "relative_l2", "hausdorff_mm"}
    assert table["zero"]["relative_l2"]["mean"] == pytest.approx(1.0)
    assert table["bundle"]["mse_mm2"]["mean"] < 0.6 * table["zero"]["mse_mm2"]["mean"]
    assert table["bundle"]["mse_mm2"]["min"] <= table["bundle"]["mse_mm2"]["mean"] <= table["bundle"]["mse_mm2"]["max"]
    f32, int8 = (results[p]["all"]["bundle"]["mse_mm2"]["mean"] for p in ("f32", "int8"))
    assert abs(f32 - int8) < 0.1 * f32


def test_a_network_trained_again_keeps_what_belongs_to_the_mesh(bundle, committed, data, mesh_path, tmp_path, capsys):
    kept, out = tmp_path / "kept", tmp_path / "again"
    shutil.copytree(bundle, kept)
    (kept / "corrections.safetensors").write_bytes(b"modes")
    (kept / "anchors.safetensors").write_bytes(b"anchors")
    manifest = read_manifest(kept)
    manifest["corrections"] = {"file": "corrections.safetensors", "recommended": 3, "calibration": 3.5}
    manifest["upt"]["anchors"] = "anchors.safetensors"
    manifest["envelope"]["tools"] = {"corrections": 3, "depth_mm": 9.0}
    manifest["description"] = "as before"
    write_manifest(kept, manifest)
    command = ["export", str(committed), "--out", str(out), "--mesh", str(mesh_path), "--data", str(data)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("upt_training.export.write_rest", lambda folder: None)  # these anchors cannot be read
        assert main([*command, "--data", str(data), "--keep", str(kept)]) == 0
    after = read_manifest(out)
    for name in ("corrections.safetensors", "anchors.safetensors", "mesh.safetensors"):
        assert (out / name).read_bytes() == (kept / name).read_bytes()
        assert after["files"][name] == read_manifest(kept)["files"][name]
    assert after["corrections"] == manifest["corrections"] and after["upt"]["anchors"] == "anchors.safetensors"
    assert after["envelope"]["tools"] == manifest["envelope"]["tools"] and after["description"] == "as before"
    assert after["requires"] == ["anchors", "corrections"]
    assert after["provenance"]["data"]["cases"] == 2 * read_manifest(bundle)["provenance"]["data"]["cases"]
    seal(kept, {"boundary": "supported"})
    assert main([*command, "--keep", str(kept)]) == 2
    assert "kept/bundle.json: boundary is supported" in capsys.readouterr().err


def test_evaluate_without_a_case_is_an_error(bundle, data, tmp_path, capsys):
    out = tmp_path / "none.json"
    assert main(["evaluate", str(bundle), "--data", str(data), "--schemes", "5", "--out", str(out)]) == 2
    assert "scheme" in capsys.readouterr().err and not out.exists()


def test_a_failed_export_leaves_the_old_bundle(bundle, committed, data, mesh_path, tmp_path, monkeypatch):
    before = (bundle / "bundle.json").read_bytes()
    monkeypatch.setattr("upt_training.bundle.TOLERANCE", 0.0)
    code = main(
        [
            "export",
            str(committed),
            "--out",
            str(bundle),
            "--mesh",
            str(mesh_path),
            "--data",
            str(data),
        ]
    )
    assert code == 2 and (bundle / "bundle.json").read_bytes() == before
    assert load_settings(CONFIGS / "tiny.toml").name == "tiny"


def test_relative_positions_go_into_the_tables(mesh_path, tmp_path):
    """Writing a bundle checks the graphs against the unfactored network; the tables must have changed."""
    text, tables = (CONFIGS / "tiny.toml").read_text(), []
    for name, line in (("plain", ""), ("relative", "relative_positions = true\n")):
        config = tmp_path / f"{name}.toml"
        config.write_text(text.replace("[model]\n", "[model]\n" + line))
        arguments = ["--config", str(config), "--mesh", str(mesh_path), "--out", str(tmp_path / name)]
        assert write_random([*arguments, "--step", "--paper-split"]) == 0
        tables.append(BundleRunner(tmp_path / name).session.tables)
    assert not np.allclose(tables[0][0], tables[1][0], atol=1e-3)
    assert tables[0][2].shape == tables[1][2].shape


def test_tables_are_exact_to_float32(bundle, committed, mesh_path):
    """embed.onnx has its angles in float64: in float32 the tables would be off by 1e-6."""
    model, _ = load_model(committed)
    mesh = load_mesh(mesh_path)
    with torch.no_grad():
        exact = model.double().tables(torch.from_numpy(mesh.positions.astype(np.float64)))
    session = onnxruntime.InferenceSession(str(bundle / "embed.onnx"), providers=["CPUExecutionProvider"])
    for found, table in zip(session.run(None, {"positions": mesh.positions}), exact, strict=True):
        assert np.linalg.norm(found - table.numpy()) < 4e-7 * np.linalg.norm(table.numpy())


def test_the_reference_step_is_the_split_in_float64(bundle, mesh_path):
    reference = load_file(str(bundle / "reference.safetensors"))
    runner = BundleRunner(bundle)
    features = runner.features(reference["contact_nodes"], reference["contact_vectors"], runner.u)
    found = runner.network(features)
    largest = np.abs(reference["displacement"]).max()
    assert largest > 1e-3 and np.abs(found - reference["displacement"]).max() < 1e-5 * largest


def test_heads_one_after_another_are_the_same_attention(committed, monkeypatch):
    model, _ = load_model(committed)
    supernodes = np.random.default_rng(2).standard_normal((48, model.settings.encoder)).astype(np.float32)
    found = []
    for limit in (1e9, 0.0):
        monkeypatch.setattr(onnx_graph, "CACHE_BYTES", limit)
        with torch.no_grad():
            graph = onnx_graph.latent_graph(model)
        found.append((len(graph.graph.node), onnxruntime.InferenceSession(graph.SerializeToString())))
    (nodes, together), (more, apart) = found
    assert more > nodes
    for a, b in zip(*(s.run(None, {"supernodes": supernodes}) for s in (together, apart)), strict=True):
        assert np.abs(a - b).max() < 1e-6 * np.abs(a).max()


def test_weights_in_half_precision_are_the_same_bundle_in_a_smaller_file(bundle, committed, data, mesh_path, tmp_path):
    out = tmp_path / "half"
    command = ["export", str(committed), "--out", str(out), "--mesh", str(mesh_path), "--data", str(data)]
    assert main([*command, "--half-weights"]) == 0
    check = json.loads((out / "bundle.json").read_text())["provenance"]["export_check"]
    assert all(0 <= v < TOLERANCE for v in check.values())
    assert (out / "latent.onnx").stat().st_size < 0.8 * (bundle / "latent.onnx").stat().st_size
    case = open_dataset(data, load_mesh(mesh_path)).select("test")[0]
    trajectory = open_trajectory(case.path, load_mesh(mesh_path))
    contacts = [trajectory.contact(t) for t in range(1, 20)]
    ends = []
    for folder in (bundle, out):
        runner = BundleRunner(folder)
        for nodes, vectors in contacts:
            state = runner.step(nodes, vectors)
        ends.append(np.array(state))
    assert 0 < np.abs(ends[0] - ends[1]).max() < 0.02 * np.abs(ends[0]).max()
