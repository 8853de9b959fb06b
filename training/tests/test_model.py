"""The network: the paper's size, factored equals unfactored, drop path at micro-batch 1, normalisation and mixing."""

from pathlib import Path

import numpy as np
import pytest
import torch

from upt_training.box_mesh import box_mesh
from upt_training.config import load_settings, settings_from_dict
from upt_training.errors import InputError
from upt_training.graph import build_graph
from upt_training.layers import DropPath, sincos
from upt_training.model import Upt, difference_mixing
from upt_training.random_bundle import random_model

CONFIGS = Path(__file__).parents[1] / "configs"


def test_paper_configuration_has_the_papers_parameter_count():
    assert 3.35e6 < Upt(load_settings(CONFIGS / "paper.toml").model).parameter_count() < 3.45e6


def test_sincos_layout():
    e = sincos(torch.tensor([[1.0, 2.0, 3.0]]), 16)[0]
    m = 4  # 16 // 3 = 5, made even
    assert torch.allclose(e[:2], torch.sin(torch.tensor([1.0, 10000.0 ** (-2 / m)])))
    assert torch.allclose(e[m + 2], torch.cos(torch.tensor(2.0))) and (e[12:] == 0).all()


@pytest.mark.parametrize("relative", [False, True])
def test_factored_equals_unfactored_in_float64(relative):
    mesh, settings = box_mesh(), load_settings(CONFIGS / "tiny-replay.toml")
    settings.model.relative_positions = relative
    model = random_model(settings, mesh, 3)
    model.mixing.copy_(difference_mixing(settings.model.features, 5.0))
    model = model.double()
    graph = build_graph(mesh, settings.model.graph)
    neighbours, mask = (torch.from_numpy(a) for a in graph.padded())
    supernodes, positions = (
        torch.from_numpy(graph.supernodes),
        torch.from_numpy(mesh.positions.astype(np.float64)),
    )
    x = torch.randn(mesh.node_count, settings.model.feature_count, dtype=torch.float64)
    with torch.no_grad():
        source, target, query = model.tables(positions)
        a = model(x, (source, target), neighbours, mask.double(), supernodes, query)
        b = model.forward_unfactored(x, positions, neighbours, mask.double(), supernodes)
    assert (a - b).abs().max() < 1e-12 * b.abs().max()


def test_a_scaled_start_passes_the_input_on():
    torch.manual_seed(0)
    model = Upt(load_settings(CONFIGS / "window.toml").model)
    x = torch.randn(1000, 48)
    narrow = model.message2(x).std()
    model.scale_start()
    assert narrow < 0.2 and 0.9 < model.message2(x).std() < 1.1


def test_drop_path_drops_at_micro_batch_one():
    torch.manual_seed(0)
    drop = DropPath(0.5).train()
    kept = [bool(drop(torch.ones(1, 4, 2)).any()) for _ in range(200)]
    assert 60 < sum(kept) < 140
    mean = torch.stack([drop(torch.ones(1, 4, 2)).mean() for _ in range(2000)]).mean()
    assert abs(float(mean) - 1.0) < 0.1
    assert torch.equal(drop.eval()(torch.ones(1, 4, 2)), torch.ones(1, 4, 2))


def test_difference_mixing_gives_residual_velocity_and_change_of_response():
    names = [
        "displacement",
        "collision",
        "previous_displacement",
        "prior",
        "previous_prior",
        "contact",
    ]
    u, c, before, prior, prior_before = torch.randn(5, 3)
    x = torch.cat([u, c, before, prior, prior_before, torch.ones(1)])
    y = difference_mixing(names, 2.0) @ x
    assert torch.allclose(y[:3], 2 * (u - prior_before)) and torch.allclose(y[6:9], 2 * (before - u))
    assert torch.allclose(y[12:15], 2 * (prior_before - prior)) and torch.allclose(y[9:12], prior)


@pytest.mark.parametrize(
    "change, word",
    [
        ({"model": {"fearures": []}}, "fearures"),
        ({"model": {"features": ["speed"]}}, "speed"),
        ({"model": {"base": "zero"}}, "base"),
        ({"model": {"vibration": True}}, "vibration"),
        ({"model": {"encoder": 30, "encoder_heads": 4}}, "multiple"),
        ({"train": {"epochs": "many"}}, "epochs"),
    ],
)
def test_wrong_configuration_names_the_field(change, word):
    with pytest.raises(InputError, match=word):
        settings_from_dict({"name": "x", **change})
