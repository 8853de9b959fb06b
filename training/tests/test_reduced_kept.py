"""A finished bundle trained again: on schemes and shorter cases of tools, with its modes and tables kept."""

import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest
from reduced_phantom import FRAMES, write_columns, write_dataset

from upt_training.box_mesh import box_mesh
from upt_training.bundle_folder import read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.reduced.__main__ import main as command
from upt_training.reduced.build import Options, build, prepare, split_states
from upt_training.reduced.evaluate import evaluate
from upt_training.reduced.kept import kept_tables
from upt_training.reduced.modes import Modes
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.states import load_states
from upt_training.reduced.train import Settings, state_pairs, summary
from upt_training.reduced.trajectories import open_dataset

SHORT = 27


def main_of(*arguments: str) -> int:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["upt_training.reduced", *arguments])
        return command()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Mesh, columns, options of a bundle that learned from schemes, and options that train it again with tools."""
    folder = tmp_path_factory.mktemp("kept")
    mesh = box_mesh()
    mesh.save(folder / "box.mesh.safetensors")
    columns = write_columns(mesh, folder / "box.columns.safetensors")
    write_dataset(mesh, columns, folder / "schemes", 20)
    write_dataset(mesh, columns, folder / "tools", 20, frames=SHORT, tool="tool-press")
    first = Options(
        mesh=folder / "box.mesh.safetensors",
        columns=columns.path,
        data=[folder / "schemes"],
        out=folder / "first",
        work=folder / "work-1",
        name="first",
        modes=12,
        response_modes=12,
        tolerance_mm=1e-3,
    )
    build(first, Settings(updates=0, hidden=8), "schemes")
    again = replace(
        first,
        data=[folder / "schemes", folder / "tools"],
        out=folder / "again",
        work=folder / "work-2",
        keep=first.out,
        name="again",
    )
    build(again, Settings(updates=60, hidden=16, stages=[(4, 8, 0.5), (24, 8, 0.5)], validate_every=30), "and tools")
    return mesh, columns, first, again


def test_only_the_correction_is_new(made):
    _, _, first, again = made
    names = {path.name for path in first.out.iterdir()}
    assert names == {path.name for path in again.out.iterdir()}
    changed = {name for name in names if (first.out / name).read_bytes() != (again.out / name).read_bytes()}
    assert changed == {"bundle.json", "latent.onnx"}
    before, after = read_manifest(first.out), read_manifest(again.out)
    assert after["name"] == "again" and after["provenance"]["data"] == ["schemes", "tools"]
    assert "tools" in after["errors"] and "tools" not in before["errors"]
    assert after["files"]["prior.safetensors"] == before["files"]["prior.safetensors"]


def test_the_kept_modes_give_the_coordinates_of_the_build(made):
    _, _, first, again = made
    with np.load(first.work / "modes.npz") as file:
        modes = Modes(**{name: file[name] for name in file.files})
    found = kept_tables(first.out, made[0], made[1])[0]
    assert np.abs(found.residual - modes.residual).max() < 0.01 * np.abs(modes.residual).max()
    for name in ("b", "z", "p"):
        one = getattr(load_states(first.work / "states-schemes.npz"), name)
        other = getattr(load_states(again.work / "states-schemes.npz"), name)
        assert np.abs(one - other).max() < 2e-3 * np.abs(one).max(), name


def test_the_end_of_a_short_case_is_no_data(made):
    _, _, _, again = made
    prepared = prepare(again)
    states = prepared.states
    short = states.length == SHORT
    assert short.sum() == 20 and (states.length[~short] == FRAMES).all()
    assert not states.b[short, SHORT:].any() and not states.contact[short, SHORT:].any()
    pairs = state_pairs(states)
    assert len(pairs[0]) == len(pairs[1]) == (states.length - 1).sum()
    scores = [summary(states.pick(mask), states.b[mask] * 0.9) for mask in (short, ~short)]
    whole = summary(states, states.b * 0.9)
    assert np.isclose(whole["mse"], np.mean([part["mse"] for part in scores])), "every case counts the same"
    assert np.isclose(whole["tools"], scores[0]["mse"]) and np.isclose(whole["schemes_1_4"], scores[1]["mse"])
    cut = states.pick(short)
    cut = replace(cut, **{name: getattr(cut, name)[:, :SHORT] for name in ("b", "contact", "push", "residual_square")})
    assert np.isclose(summary(cut, cut.b * 0.9)["mse"], scores[0]["mse"]), "its zeros behind the end do not count"
    fit, validation, _ = split_states(states)
    assert {"tool-press"} < set(fit.scheme) and "tool-press" in validation.scheme


def test_tools_are_scored_beside_the_schemes(made):
    mesh, _, first, again = made
    cases = open_dataset(first.out.parent / "tools", mesh.sha256, "test")
    errors = evaluate(again.out, cases)
    assert set(errors["reduced"]) == {"tools"}
    assert errors["reduced"]["tools"]["mse_mm2"] < errors["prior"]["tools"]["mse_mm2"]


def test_the_average_of_two_trainings_gives_the_mean_of_their_corrections(made, tmp_path):
    _, _, first, again = made
    out = tmp_path / "mean"
    assert main_of("average", str(first.out), str(again.out), "--out", str(out)) == 0
    state = np.random.default_rng(3).normal(size=(1, ReducedRunner(first.out).session.get_inputs()[0].shape[1]))
    results = [
        ReducedRunner(folder).session.run(None, {"state": state.astype(np.float32)})[0]
        for folder in (first.out, again.out, out)
    ]
    assert np.abs(results[0] - results[1]).max() > 1e-3
    assert np.allclose(results[2], (results[0] + results[1]) / 2, rtol=1e-5, atol=1e-6)
    before, manifest = read_manifest(again.out), read_manifest(out)
    assert manifest["reduced"]["bound"]["relative"] >= before["reduced"]["bound"]["relative"]
    assert [part["data"] for part in manifest["provenance"]["mean_of"]] == [["schemes"], ["schemes", "tools"]]
    assert (out / "prior.safetensors").read_bytes() == (first.out / "prior.safetensors").read_bytes()


def test_trainings_of_other_tables_are_not_averaged(made, tmp_path, capsys):
    _, _, first, again = made
    other = tmp_path / "other"
    shutil.copytree(again.out, other)
    (other / "prior.safetensors").write_bytes(b"another")
    write_manifest(other, read_manifest(other))
    assert main_of("average", str(first.out), str(other), "--out", str(tmp_path / "mean")) == 2
    assert "other/bundle.json: has other tables" in capsys.readouterr().err and not (tmp_path / "mean").exists()


def test_states_in_the_modes_of_another_bundle_are_refused(made):
    _, _, first, again = made
    with pytest.raises(InputError, match="work-1: its states are in the modes of another bundle"):
        prepare(replace(again, work=first.work))
    with pytest.raises(InputError, match="work-2: its states"):
        prepare(replace(first, work=again.work))
    assert prepare(again).states.cases == 40


def test_a_bundle_of_another_mesh_is_refused(made):
    _, columns, first, _ = made
    other = box_mesh(cells=(5, 5, 4), spacing_mm=9.0)
    with pytest.raises(InputError, match="first/bundle.json: mesh_sha256 differs from --mesh"):
        kept_tables(first.out, other, columns)
