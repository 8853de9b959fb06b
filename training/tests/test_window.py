"""A training window's levers: the gradient of the plain path, or its mean over draws; resumed to the same bits."""

import copy
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CONFIGS

from upt_training.bench import PlainWindows
from upt_training.captured import CapturedWindows
from upt_training.config import Settings, load_settings
from upt_training.errors import InputError
from upt_training.layers import attend
from upt_training.mesh_file import load_mesh
from upt_training.run import make_trainer
from upt_training.trainer import Trainer
from upt_training.window import Windows, fast_bf16


def settings_with(name: str, **values) -> Settings:
    settings = load_settings(CONFIGS / name)
    for key, value in values.items():
        setattr(settings.train, key, value)
    return settings


@pytest.fixture
def make(data, mesh_path, tmp_path):
    def trainer(settings: Settings) -> Trainer:
        made = make_trainer(copy.deepcopy(settings), data, load_mesh(mesh_path), None, tmp_path, "cpu")
        made.model.scale_start()  # fresh weights hardly move a state: gradients through time would not show
        return made

    return trainer


def gradient(trainer: Trainer, windows: Windows, p: float, seed: int = 3) -> torch.Tensor:
    trainer.generator.bit_generator.state = np.random.PCG64([seed]).state
    trainer.draw.manual_seed(seed)
    trainer.optimiser.zero_grad(set_to_none=True)
    windows.loss(p)[0].backward()
    return torch.cat([q.grad.flatten() for q in trainer.model.parameters()])


def plain(trainer: Trainer) -> PlainWindows:
    w = trainer.windows
    trainer.model.padded = True
    return PlainWindows(w.settings, w.stepper, w.cache, w.pool, w.generator, w.draw, w.noise)


def relative(a: torch.Tensor, b: torch.Tensor) -> float:
    return float((a - b).norm() / b.norm())


@pytest.mark.parametrize("p", [1.0, 0.6, 0.0])
@pytest.mark.parametrize(("resident", "batch"), [(0.0, 1), (1.0, 3)])
def test_a_window_has_the_gradient_of_the_plain_path(make, p, resident, batch):
    settings = settings_with("tiny.toml", micro_batch=batch, window=4)
    reference = make(settings)
    settings.train.resident_gb = resident
    trainer = make(settings)
    for seed in range(4):
        expected = gradient(reference, plain(reference), p, seed)
        assert relative(gradient(trainer, trainer.windows, p, seed), expected) < 1e-5
    assert bool(trainer.train_cache.resident) == (resident > 0)


@pytest.mark.parametrize(("strategy", "p"), [("stf", 1.0), ("stf", 0.6), ("stf", 0.0), ("teacher", 1.0)])
def test_passes_of_fixed_shape_have_the_gradient_of_the_plain_path(make, strategy, p):
    """What a CUDA graph records, run pass by pass. At p = 1 the plain path starts a prediction later."""
    settings = settings_with("tiny.toml", micro_batch=3, window=4, strategy=strategy, resident_gb=1.0)
    trainer = make(settings)
    captured = CapturedWindows(trainer.windows, trainer.loss_scale, capture=False)
    if strategy == "stf" and p == 1.0:
        p = 1.0 - 1e-9
    for seed in range(3):
        expected = gradient(trainer, trainer.windows, p, seed) * trainer.loss_scale
        trainer.generator.bit_generator.state = np.random.PCG64([seed]).state
        trainer.draw.manual_seed(seed)
        mse = captured.step(p)
        found = torch.cat([q.grad.flatten() for q in trainer.model.parameters()])
        assert relative(found, expected) < 1e-5 and mse > 0.0


def test_passes_of_fixed_shape_draw_rows_and_supernodes(make):
    """On the same rows and supernodes as a window that makes every prediction; the state has the same gradient."""
    settings = settings_with("tiny.toml", micro_batch=2, window=3, resident_gb=1.0, scored_rows=20, drawn_supernodes=16)
    trainer = make(settings)
    captured = CapturedWindows(trainer.windows, trainer.loss_scale, capture=False)
    expected = gradient(trainer, trainer.windows, 0.0) * trainer.loss_scale
    trainer.generator.bit_generator.state = np.random.PCG64([3]).state
    trainer.draw.manual_seed(3)
    captured.step(0.0)
    found = torch.cat([q.grad.flatten() for q in trainer.model.parameters()])
    assert relative(found, expected) < 1e-5
    assert not trainer.model.padded  # evaluation goes over the edges that there are


@pytest.mark.parametrize("change", [{"strategy": "replay"}, {"accumulate": 2}, {"resident_gb": 0.0}])
def test_a_graph_refuses_what_its_passes_leave_out(make, change):
    values = {"resident_gb": 1.0, "accumulate": 1, **change}
    trainer = make(settings_with("tiny.toml", **values))
    with pytest.raises(InputError, match=r"train.cuda_graph does not go with this " + next(iter(change))):
        CapturedWindows(trainer.windows, 1.0, capture=False)


def test_a_first_prediction_that_nothing_reads_is_not_made(make):
    trainer = make(settings_with("tiny.toml", micro_batch=1, window=3))
    calls, step = [], trainer.stepper.step
    trainer.stepper.step = lambda *a: (calls.append(1), step(*a))[1]
    trainer.windows.loss(1.0 - 1e-12)
    assert len(calls) == 2
    trainer.windows.loss(0.0)
    assert len(calls) == 5


@pytest.mark.parametrize(("p", "batch"), [(0.0, 1), (0.6, 3)])
def test_the_mean_over_scored_rows_is_the_gradient_of_all_rows(make, p, batch):
    """Three predictions, each fed by the one before; the rows of each are one half or the other: eight gradients."""
    reference = make(settings_with("tiny.toml", micro_batch=batch, window=3))
    settings = reference.settings
    expected = gradient(reference, plain(reference), p)
    settings.train.scored_rows = reference.stepper.node_count // 2
    trainer = make(settings)
    n = trainer.stepper.node_count
    assert n % 2 == 0
    halves = torch.randperm(n, generator=torch.Generator().manual_seed(5)).reshape(2, -1)
    found = []
    for choice in np.ndindex(2, 2, 2):
        picks = iter(choice)
        trainer.windows.rows = lambda count, picks=picks: halves[next(picks)]
        found.append(gradient(trainer, trainer.windows, p))
    assert relative(torch.stack(found).mean(0), expected) < 1e-4
    assert relative(found[0], expected) > 1e-2


def test_drawn_supernodes_are_rows_of_the_graph_and_all_of_them_change_nothing(make):
    settings = settings_with("tiny.toml", micro_batch=1)
    reference = make(settings)
    every = reference.stepper.all
    some = reference.stepper.draw(10, torch.Generator().manual_seed(1))
    at = torch.searchsorted(every.supernodes, some.supernodes)
    assert len(some.supernodes) == 10 and torch.equal(every.supernodes[at], some.supernodes)
    assert torch.equal(every.neighbours[at], some.neighbours) and torch.equal(every.mask[at], some.mask)
    assert set(some.read.tolist()) == set(some.neighbours[some.mask > 0].tolist()) | set(some.supernodes.tolist())
    expected = gradient(reference, plain(reference), 0.0)
    settings.train.drawn_supernodes = len(every.supernodes)
    trainer = make(settings)
    assert relative(gradient(trainer, trainer.windows, 0.0), expected) < 1e-5


def test_bfloat16_gives_the_gradient_up_to_its_rounding_and_only_where_it_is_fast(make):
    settings = settings_with("tiny.toml", micro_batch=1)
    reference = make(settings)
    expected = gradient(reference, plain(reference), 0.0)
    settings.train.bf16 = True
    trainer = make(settings)
    assert trainer.windows.bf16 == fast_bf16(torch.device("cpu"))
    assert relative(gradient(trainer, trainer.windows, 0.0), expected) < (0.1 if trainer.windows.bf16 else 1e-5)
    trainer.windows.bf16 = True  # slow elsewhere, and the same
    assert relative(gradient(trainer, trainer.windows, 0.0), expected) < 0.1


def test_attention_in_bfloat16_is_attention():
    q, k, v = (torch.randn(2, 40, 16, generator=torch.Generator().manual_seed(i)) for i in range(3))
    expected, found = attend(q, k, v, 2), attend(q, k.bfloat16(), v.bfloat16(), 2)
    assert found.dtype == torch.bfloat16 and (found.float() - expected).abs().max() < 0.02


def test_cases_in_memory_are_the_mapped_ones(make):
    cache = make(settings_with("tiny.toml")).train_cache
    cases, frames = np.array([0, 2, 1]), np.array([3, 0, -1])
    mapped = cache.fields(cases, frames)
    assert not cache.hold(1e-9, torch.device("cpu")) and not cache.resident
    assert cache.hold(1.0, torch.device("cpu"))
    held = cache.fields(cases, frames)
    assert held.keys() == mapped.keys() and all(torch.equal(held[k], mapped[k]) for k in held)


def test_a_resumed_run_with_all_levers_is_the_uninterrupted_one_to_the_bit(data, mesh_path, tmp_path):
    for config in ("tiny.toml", "tiny-replay.toml"):
        levers = {"scored_rows": 20, "drawn_supernodes": 16, "bf16": True, "resident_gb": 1.0, "ema": 0.9}
        settings, mesh = settings_with(config, **levers), load_mesh(mesh_path)
        settings.model.drop_path = 0.2

        def trainer(name: str, settings=settings, mesh=mesh) -> Trainer:
            folder: Path = tmp_path / name
            folder.mkdir(exist_ok=True)
            return make_trainer(settings, data, mesh, None, folder, "cpu")

        whole = trainer(f"{config}-whole")  # drop path draws from the global state, which a trainer seeds
        for _ in range(8):
            whole.train_step()
        first = trainer(f"{config}-first")
        for _ in range(5):
            first.train_step()
        first.save("last.pt")
        second = trainer(f"{config}-first")
        second.resume(tmp_path / f"{config}-first" / "last.pt")
        for _ in range(3):
            second.train_step()
        for model in ("model", "ema"):
            for a, b in zip(getattr(whole, model).parameters(), getattr(second, model).parameters(), strict=True):
                assert torch.equal(a, b)
