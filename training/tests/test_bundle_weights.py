"""`train --init BUNDLE` and `paper_split`: a model that computes what the bundle does, and what has no such model."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from upt_training.bundle import BundleSession, run_paper_split
from upt_training.bundle_weights import bundle_state
from upt_training.config import settings_from_dict
from upt_training.errors import InputError
from upt_training.graph import build_graph
from upt_training.mesh_file import load_mesh
from upt_training.model import Upt, load_state
from upt_training.paper_split import main as paper_split

BUNDLE = Path(__file__).parents[2] / "tests/fixtures/tiny-upt-prior"


def model_like(bundle: Path, **changes) -> Upt:
    manifest = json.loads((bundle / "bundle.json").read_text())
    architecture = manifest["provenance"]["architecture"] | changes
    model = Upt(settings_from_dict({"name": "like", "model": architecture}).model)
    # Neither is in a bundle: the run that starts has its own.
    model.set_normalisation([0.0] * 3, [1.0] * 3, [0.1, 0.2, 0.3], 3.0)
    return model


def test_the_weights_compute_what_the_bundle_does():
    model = model_like(BUNDLE)
    draws = torch.get_rng_state()
    load_state(model, bundle_state(BUNDLE, model), str(BUNDLE))
    assert torch.equal(torch.get_rng_state(), draws)
    mesh = load_mesh(BUNDLE / "mesh.safetensors")
    graph = build_graph(mesh, model.settings.graph)
    features = np.random.default_rng(1).normal(size=(mesh.node_count, model.settings.feature_count)).astype(np.float32)
    expected = BundleSession(BUNDLE, mesh, graph)(features)
    neighbours, mask = (torch.from_numpy(a) for a in graph.padded())
    with torch.no_grad():
        source, target, query = model.tables(torch.from_numpy(mesh.positions.astype(np.float32)))
        supernodes = torch.from_numpy(graph.supernodes)
        found = model(torch.from_numpy(features), (source, target), neighbours, mask, supernodes, query).numpy()
    assert np.abs(expected).max() > 0.05
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()
    assert torch.equal(model.output_scale, torch.tensor([0.1, 0.2, 0.3]))


def test_the_split_of_a_bundle_computes_what_the_bundle_does(tmp_path, capsys):
    assert paper_split([str(BUNDLE), "--out", str(tmp_path / "split")]) == 0
    mesh, like = load_mesh(BUNDLE / "mesh.safetensors"), model_like(BUNDLE)
    graph = build_graph(mesh, like.settings.graph)
    features = np.random.default_rng(2).normal(size=(mesh.node_count, like.settings.feature_count)).astype(np.float32)
    expected = BundleSession(BUNDLE, mesh, graph)(features)
    found = run_paper_split(tmp_path / "split", mesh, graph, features)
    assert np.abs(expected).max() > 0.05
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()
    assert paper_split([str(BUNDLE.parent / "tiny-reduced"), "--out", str(tmp_path / "none")]) == 2
    assert "tiny-reduced: not of kind `upt`" in capsys.readouterr().err


def test_another_architecture_and_a_bundle_without_one_are_refused(tmp_path):
    with pytest.raises(InputError, match="encoder_depth = 1, the configuration asks for 2"):
        bundle_state(BUNDLE, model_like(BUNDLE, encoder_depth=2))
    with pytest.raises(InputError, match="only `upt` bundles"):
        bundle_state(BUNDLE.parent / "tiny-reduced", model_like(BUNDLE))
    copy = tmp_path / "copy"
    shutil.copytree(BUNDLE, copy)
    manifest = json.loads((copy / "bundle.json").read_text())
    del manifest["provenance"]["architecture"]
    manifest.pop("manifest_sha256", None)
    (copy / "bundle.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="no provenance.architecture"):
        bundle_state(copy, model_like(BUNDLE))
