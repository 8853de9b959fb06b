"""Equilibria in the build of reduced models: read apart from motion, fitted by the static map, held by the rollouts."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from reduced_phantom import write_columns, write_dataset, write_statics

from upt_training.box_mesh import box_mesh
from upt_training.reduced.build import Options, Prepared, build, envelope_of, finish, prepare
from upt_training.reduced.rollout import Limits, rollout
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.train import Settings, holds
from upt_training.reduced.train import prepare as prepare_model
from upt_training.reduced.trajectories import open_dataset


def options_of(folder: Path, work: str, data: list[str]) -> Options:
    return Options(
        mesh=folder / "box.mesh.safetensors",
        columns=folder / "box.columns.safetensors",
        data=[folder / name for name in data],
        out=folder / f"{work}-bundle",
        work=folder / work,
        name="box-reduced",
        modes=12,
        response_modes=12,
        tolerance_mm=1e-3,
    )


@pytest.fixture(scope="module")
def prepared(tmp_path_factory) -> tuple[Options, Prepared]:
    """Six moving cases beside 24 cases of equilibria, projected."""
    folder = tmp_path_factory.mktemp("statics")
    mesh = box_mesh()
    mesh.save(folder / "box.mesh.safetensors")
    columns = write_columns(mesh, folder / "box.columns.safetensors")
    write_dataset(mesh, columns, folder / "data", 6)
    write_statics(mesh, columns, folder / "statics", 24)
    options = options_of(folder, "work", ["data", "statics"])
    return options, prepare(options)


def test_equilibria_are_no_motion(prepared):
    options, made = prepared
    assert made.states.cases == 6 and set(made.states.scheme) <= {"1", "2", "3", "4"}
    statics = made.statics
    # The second case lacks one.
    assert statics.count == 24 * 8 - 1
    assert 80 < len(np.unique(statics.site)) <= 24 * 4
    assert np.bincount(statics.site).min() >= 1 and statics.push.min() > 2.5
    # A second build reads what the first one projected.
    assert prepare(options).statics.count == statics.count


def test_the_envelope_takes_pushes_of_equilibria_and_no_rate(prepared):
    options, made = prepared
    moving = [case for case in made.cases if not case.is_static]
    alone, both = envelope_of(moving, made.mesh), envelope_of(made.cases, made.mesh)
    assert both["max_push_rate_mm"] == alone["max_push_rate_mm"]
    assert both["max_push_mm"] > alone["max_push_mm"] and both["max_sites"] == 1
    for case in made.cases:
        case.scheme = "static-two" if case.is_static else case.scheme
    assert envelope_of(made.cases, made.mesh)["max_sites"] == 2
    for case in made.cases:
        case.scheme = "static" if case.is_static else case.scheme


def error_of(model, statics) -> float:
    with torch.no_grad():
        left = model.static(torch.from_numpy(statics.z)).numpy() - statics.b
    return float((left**2).sum() / (statics.b**2).sum())


@pytest.mark.parametrize("hidden", [0, 24])
def test_equilibria_teach_sites_that_motion_has_not(prepared, hidden):
    _, made = prepared
    unseen = made.statics.site % 4 == 0
    known, held_out = made.statics.pick(~unseen), made.statics.pick(unseen)
    settings = Settings(hidden=8, quadratic_modes=8, static_hidden=hidden, static_updates=500)
    alone = error_of(prepare_model(made.states, settings), held_out)
    taught = error_of(prepare_model(made.states, settings, known), held_out)
    assert taught < alone


def test_an_equilibrium_that_is_held_stays(prepared):
    _, made = prepared
    settings = Settings(hidden=8, quadratic_modes=8, static_hidden=24, static_updates=500)
    model = prepare_model(made.states, settings, made.statics)
    limits = Limits(relative=1.5)
    drive, rest, bound = holds(made.statics, np.arange(40), 12, limits)
    with torch.no_grad():
        end = rollout(model, drive, rest, rest, bound, limits)[:, -1]
    assert float(((end - rest) ** 2).sum() / (rest**2).sum()) < 1.0


def test_a_bundle_with_a_static_network_runs_and_is_better(prepared):
    options, made = prepared
    few = Settings(hidden=8, updates=40, quadratic_modes=8, validate_every=20)
    settings = replace(few, static_hidden=24, static_updates=500)
    finish(options, settings, "phantom", made)
    manifest = json.loads((options.out / "bundle.json").read_text())
    # The graph was compared with PyTorch when it was written.
    assert manifest["provenance"]["self_check"]["onnxruntime_vs_pytorch"] < 1e-5
    assert manifest["provenance"]["equilibria"] == made.statics.count

    plain = options_of(options.mesh.parent, "plain", ["data"])
    build(plain, few, "phantom")
    errors = []
    for folder in (options.out, plain.out):
        runner, square = ReducedRunner(folder), 0.0
        case = open_dataset(options.data[1], made.mesh.sha256)[0]
        for frame in range(1, case.frames):
            rows = slice(case.offsets[frame], case.offsets[frame + 1])
            runner.reset()
            for _ in range(30):
                found = runner.step(case.nodes[rows], case.vectors[rows])
            square += float(((found - case.displacement[frame]) ** 2).sum())
        errors.append(square)
    assert errors[0] < errors[1]
