"""Free vibration: modes against a dense solver, steps against the matrix exponential, training against bundle."""

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import torch
from conftest import CONFIGS
from safetensors.numpy import save_file
from test_reduced import dense_stiffness

from upt_training import vibration
from upt_training.__main__ import main
from upt_training.bundle_rollout import BundleRunner
from upt_training.config import load_settings
from upt_training.dataset import map_safetensors, open_dataset, open_trajectory
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.prior_table import PriorTable, propagator
from upt_training.run import make_trainer
from upt_training.vibration import MATERIAL, eigenmodes, lumped_mass

PRIOR = Path(__file__).parents[2] / "tests/fixtures/tiny-reduced/prior.safetensors"


@pytest.fixture(scope="module")
def swings(mesh_path, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("vibration") / "vibration.safetensors"
    arguments = ["--mesh", str(mesh_path), "--prior", str(PRIOR), "--modes", "12", "--out", str(out)]
    assert vibration.main(arguments) == 0
    return out


def test_eigenmodes_equal_a_dense_solver(mesh_path):
    mesh = load_mesh(mesh_path)
    frequency, modes = eigenmodes(mesh, "fixed", MATERIAL, 6)
    free = np.setdiff1d(np.arange(mesh.node_count), mesh.fixed)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    mass = np.repeat(lumped_mass(mesh, 1000.0)[free], 3)
    exact = scipy.linalg.eigh(dense_stiffness(mesh)[np.ix_(dofs, dofs)], np.diag(mass), eigvals_only=True)
    assert np.allclose(frequency**2, exact[:6], rtol=1e-6)
    assert np.allclose((modes[:, dofs] * mass) @ modes[:, dofs].T, np.eye(6), atol=1e-9)
    assert np.abs(modes[:, np.setdiff1d(np.arange(3 * mesh.node_count), dofs)]).max() == 0.0


def test_a_region_has_the_mass_of_its_density(mesh_path):
    mesh = load_mesh(mesh_path)
    plain = lumped_mass(mesh, 1000.0)
    mesh.region = np.full(len(mesh.tets), 2, np.int32)
    mesh.metadata["laws"] = '[{"name": "a"}, {"name": "b", "density_kg_m3": 1850}]'
    assert np.allclose(lumped_mass(mesh, 1000.0), 1.85 * plain)
    mesh.region[:] = 1
    assert np.allclose(lumped_mass(mesh, 1000.0), plain)


def test_modes_of_a_file_are_taken_and_those_of_another_body_refused(mesh_path, swings, tmp_path, capsys):
    mesh = load_mesh(mesh_path)
    frequency, modes = eigenmodes(mesh, "fixed", MATERIAL, 12)
    metadata = {"mesh_sha256": mesh.sha256, "boundary": "fixed", **{k: str(v) for k, v in MATERIAL.items()}}
    tensors = {"frequency": np.float32(frequency), "modes": np.ascontiguousarray(modes, np.float32)}
    save_file(tensors, str(tmp_path / "modes.safetensors"), metadata=metadata)
    arguments = ["--mesh", str(mesh_path), "--prior", str(PRIOR), "--natural", str(tmp_path / "modes.safetensors")]
    assert vibration.main([*arguments, "--out", str(tmp_path / "out.safetensors")]) == 0
    found, own = map_safetensors(tmp_path / "out.safetensors")[0], map_safetensors(swings)[0]
    for name in ("frequency", "modes", "force_to_mode"):
        assert np.allclose(found[name], own[name], atol=1e-5 * np.abs(own[name]).max())
    save_file(tensors, str(tmp_path / "modes.safetensors"), metadata={**metadata, "poisson": "0.45"})
    assert vibration.main([*arguments, "--out", str(tmp_path / "other.safetensors")]) == 2
    assert "poisson is 0.45, not 0.49" in capsys.readouterr().err
    assert not (tmp_path / "other.safetensors").exists()


@pytest.mark.parametrize("frequency", [6.0, 10.0, 70.0])
def test_a_step_is_exact_below_at_and_above_critical_damping(frequency):
    damping, dt = 20.0, 0.05
    exact = scipy.linalg.expm(dt * np.array([[0.0, 1.0], [-(frequency**2), -damping]]))
    a, b, c, d = propagator(np.array([frequency]), damping, dt)[0]
    assert np.allclose([a, b, c, d], [exact[0, 0], exact[0, 1] / dt, exact[1, 0] * dt, exact[1, 1]], atol=1e-6)


def test_the_response_swings_on_after_a_release_and_dies_away(mesh_path, data, swings):
    mesh = load_mesh(mesh_path)
    case = open_dataset(data, mesh).cases[0]
    nodes, vectors = open_trajectory(case.path, mesh).contact(8)
    table = PriorTable(PRIOR, mesh.node_count, swings)
    sequence, still = table.sequence(), PriorTable(PRIOR, mesh.node_count).sequence()
    for part in (sequence, still):
        pushed = [part.step(nodes, vectors) for _ in range(3)][-1]
    assert np.array_equal(pushed, table.restrict(None).response(nodes, vectors))
    none = nodes[:0], vectors[:0]
    size = [np.linalg.norm(sequence.step(*none)) / np.linalg.norm(pushed) for _ in range(40)]
    assert 0.05 < size[0] < 1.0 and size[-1] < 1e-3
    assert not still.step(*none).any()


def test_a_bundle_with_vibration_rolls_as_in_training(mesh_path, data, swings, tmp_path):
    mesh, settings = load_mesh(mesh_path), load_settings(CONFIGS / "tiny-prior.toml")
    run, out = tmp_path / "run", tmp_path / "bundle"
    run.mkdir()
    table = PriorTable(PRIOR, mesh.node_count, swings)
    trainer = make_trainer(settings, data, mesh, table, run, "cpu")
    with torch.no_grad():
        for value in trainer.model.parameters():
            value.mul_(2.0)
    trainer.save("last.pt")
    files = ["--mesh", str(mesh_path), "--data", str(data), "--prior", str(PRIOR)]
    assert main(["export", str(run), "--out", str(out), *files]) == 2  # the tables are asked for
    assert not out.exists()
    assert main(["export", str(run), "--out", str(out), *files, "--vibration", str(swings)]) == 0
    runner, state, tables = BundleRunner(out), trainer.stepper.rest(1), trainer.stepper.tables()
    trajectory = open_trajectory(open_dataset(data, mesh).select("test")[0].path, mesh)
    free = 0
    with torch.no_grad():
        for t in range(1, trajectory.frame_count):
            target = trainer.test_cache.fields(np.array([0]), np.array([t]))
            state = trainer.stepper.step(state, target, tables)
            nodes, vectors = (np.array(part) for part in trajectory.contact(t))
            found, trained = runner.step(nodes, vectors), state.u[0].numpy()
            enforced = np.union1d(nodes, mesh.fixed)  # this configuration leaves them to the network in training
            found[enforced] = trained[enforced]
            assert np.abs(found - trained).max() < 5e-3  # training reads half precision
            free += len(nodes) == 0 and np.abs(runner.prior_now).max() > 0.05
    assert free >= 2


def test_tables_of_another_prior_are_refused(mesh_path, swings, tmp_path):
    from safetensors.numpy import load_file, save_file

    tensors = load_file(str(swings))
    tensors["modes"] = np.ascontiguousarray(tensors["modes"][:, :-8])
    save_file(tensors, str(tmp_path / "other.safetensors"))
    with pytest.raises(InputError, match="modes"):
        PriorTable(PRIOR, load_mesh(mesh_path).node_count, tmp_path / "other.safetensors")
