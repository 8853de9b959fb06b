"""Training: the loss falls along its gradient, a trained network moves from rest, a resumed run is the same run."""

import csv
import shutil
from pathlib import Path

import numpy as np
import torch
from conftest import CONFIGS

from upt_training.__main__ import main
from upt_training.config import load_settings
from upt_training.mesh_file import load_mesh
from upt_training.rollout import State, cache_rollout, squared_error
from upt_training.run import make_trainer


def train(data: Path, mesh: Path, out: Path, config: str = "tiny.toml", *more: str) -> int:
    arguments = [
        "train",
        "--config",
        str(CONFIGS / config),
        "--data",
        str(data),
        "--mesh",
        str(mesh),
        "--out",
        str(out),
    ]
    return main([*arguments, "--device", "cpu", *more])


def rows(run: Path) -> list[dict]:
    with (run / "log.csv").open() as file:
        return list(csv.DictReader(file))


def test_training_lowers_the_loss(trained):
    log = rows(trained)
    assert float(log[-1]["train_mse_mm2"]) < float(log[0]["train_mse_mm2"])


def test_the_gradient_of_a_window_is_its_slope(data, mesh_path, tmp_path):
    """In double precision, along a random direction: what the optimiser follows is the slope of what it minimises."""
    settings = load_settings(CONFIGS / "tiny.toml")
    trainer = make_trainer(settings, data, load_mesh(mesh_path), None, tmp_path, "cpu")
    model, stepper, cache = trainer.model.double().eval(), trainer.stepper, trainer.train_cache
    stepper.positions, stepper.free = stepper.positions.double(), stepper.free.double()
    encoded = stepper.all._replace(mask=stepper.all.mask.double())
    targets = [
        {key: value.double() for key, value in cache.fields(np.array([0, 1]), np.full(2, t)).items()}
        for t in range(4, 7)
    ]

    def loss() -> torch.Tensor:
        rest = torch.zeros(2, stepper.node_count, 3, dtype=torch.float64)
        state, tables, total = State(rest, rest, None), stepper.tables(), 0.0
        for target in targets:
            fields = {"displacement": state.u, "previous_displacement": state.previous}
            fields |= {"collision": target["c"], "contact": target["contact"]}
            source, key, query = tables
            out = model(model.normalise(fields), (source, key), *encoded[:3], query)
            state = State(out, state.u, None)
            total = total + squared_error(out, target["u"]).mean()
        return total

    draw = torch.Generator().manual_seed(3)
    directions = [torch.randn(p.shape, generator=draw, dtype=torch.float64) for p in model.parameters()]
    value = loss()
    slopes = torch.autograd.grad(value, list(model.parameters()))
    slope = sum(float((a * b).sum()) for a, b in zip(slopes, directions, strict=True))
    step, sides = 1e-6, []
    with torch.no_grad():
        for sign in (1.0, -2.0):
            for parameter, direction in zip(model.parameters(), directions, strict=True):
                parameter.add_(direction, alpha=sign * step)
            sides.append(float(loss()))
    found = (sides[0] - sides[1]) / (2 * step)
    assert abs(slope) > 1e-3 and abs(found - slope) < 1e-5 * abs(slope)


def test_a_trained_network_beats_predicting_zero(committed, data, mesh_path):
    trainer = make_trainer(load_settings(committed / "config.toml"), data, load_mesh(mesh_path), None, committed, "cpu")
    trainer.start_from(committed / "best.pt")
    cache = trainer.test_cache
    zero = np.mean([(cache.displacement[c].astype(np.float64) ** 2).sum(-1).mean() for c in range(cache.case_count)])
    assert trainer.evaluate()["mse_mm2"] < 0.6 * zero


def test_a_rollout_from_rest_moves_away_from_the_contact(committed, data, mesh_path):
    """A network that copies its input stays at rest: the free nodes below the contact must move."""
    trainer = make_trainer(load_settings(committed / "config.toml"), data, load_mesh(mesh_path), None, committed, "cpu")
    trainer.start_from(committed / "best.pt")
    cache, cases = trainer.test_cache, np.arange(trainer.test_cache.case_count)
    assert cache_rollout(trainer.stepper, cache, cases)["moved"][:, -6:].max() > 1.0
    state, tables = trainer.stepper.rest(1), trainer.stepper.tables()
    touched = np.zeros(trainer.stepper.node_count, bool)
    with torch.no_grad():
        for t in range(1, 13):
            target = cache.fields(np.array([0]), np.array([t]))
            touched |= target["contact"][0, :, 0].numpy() > 0
            state = trainer.stepper.step(state, target, tables)
    truth = target["u"][0].norm(dim=1).numpy()[~touched]
    found = state.u[0].norm(dim=1).numpy()[~touched]
    assert found[truth > 2.0].mean() > 0.25 * truth[truth > 2.0].mean()


def test_resumed_run_equals_the_uninterrupted_one(data, mesh_path, tmp_path):
    for config in ("tiny.toml", "tiny-replay.toml"):
        settings = load_settings(CONFIGS / config)
        settings.train.ema = 0.9
        mesh = load_mesh(mesh_path)
        whole, first = tmp_path / f"{config}-whole", tmp_path / f"{config}-first"
        for folder in (whole, first):
            folder.mkdir()
        a = make_trainer(settings, data, mesh, None, whole, "cpu")
        for _ in range(12):
            a.train_step()
        b = make_trainer(settings, data, mesh, None, first, "cpu")
        for _ in range(7):
            b.train_step()
        b.save("last.pt")
        c = make_trainer(settings, data, mesh, None, first, "cpu")
        c.resume(first / "last.pt")
        for _ in range(5):
            c.train_step()
        for model in ("model", "ema"):
            for (name, x), y in zip(
                getattr(a, model).state_dict().items(),
                getattr(c, model).state_dict().values(),
                strict=True,
            ):
                assert torch.equal(x, y), name


def test_teacher_forcing_window_scores_one_true_step(data, mesh_path, tmp_path):
    settings = load_settings(CONFIGS / "tiny.toml")
    settings.train.strategy = "teacher"
    trainer = make_trainer(settings, data, load_mesh(mesh_path), None, tmp_path, "cpu")
    calls = []
    step = trainer.stepper.step
    trainer.stepper.step = lambda *a: (calls.append(1), step(*a))[1]
    trainer.train_step()
    assert len(calls) == settings.train.accumulate and trainer.teacher_probability() == 1.0


def test_a_run_is_not_overwritten_and_a_time_limit_leaves_a_checkpoint(data, mesh_path, tmp_path, capsys):
    out = tmp_path / "run"
    assert train(data, mesh_path, out, "tiny.toml", "--max-minutes", "1e-9") == 0
    assert "time limit" in capsys.readouterr().out
    assert train(data, mesh_path, out) == 2
    assert "already holds a run" in capsys.readouterr().err
    before = (out / "last.pt").read_bytes()
    shutil.copyfile(CONFIGS / "tiny-replay.toml", out / "config.toml")
    assert train(data, mesh_path, out, "tiny.toml", "--resume", "--max-minutes", "1e-9") == 2
    assert "another configuration" in capsys.readouterr().err
    trainer = make_trainer(load_settings(CONFIGS / "tiny.toml"), data, load_mesh(mesh_path), None, tmp_path, "cpu")
    saved, trainer.total_steps = [], 3
    trainer.save, trainer.settings.train.evaluate_every = saved.append, 10**9
    trainer.fit(report=lambda *a, **k: None, checkpoint_minutes=1e-9)
    assert saved == ["last.pt", "last.pt", "best.pt", "last.pt"]
    assert (out / "last.pt").read_bytes() == before
