"""Reduced models on a phantom: the response against a direct dense solve, the bound, the whole build and its export."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from reduced_phantom import FRAMES, dense_stiffness, write_columns, write_dataset

from upt_training.box_mesh import box_mesh
from upt_training.errors import InputError
from upt_training.lend import Lender
from upt_training.mesh_file import Mesh
from upt_training.reduced.block_basis import build_block_basis, groups
from upt_training.reduced.blocks import partition
from upt_training.reduced.build import Options, build, split_states, trainable, training_states
from upt_training.reduced.columns import Columns
from upt_training.reduced.compare import compare
from upt_training.reduced.domain import beside_domain, patches_of_domain, worst_of_domain
from upt_training.reduced.evaluate import evaluate
from upt_training.reduced.make_prior import make_prior, prior_error
from upt_training.reduced.modes import Modes
from upt_training.reduced.near import near_tensors
from upt_training.reduced.network import Correction
from upt_training.reduced.patches import sample_forces
from upt_training.reduced.prior import load_prior, save_prior
from upt_training.reduced.response_error import response_error
from upt_training.reduced.rollout import Limits, drive_of, rollout, rollout_from_rest, true_limits
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.states import load_states, project_cases
from upt_training.reduced.sweep import floor, sweep
from upt_training.reduced.train import Settings
from upt_training.reduced.trajectories import open_dataset
from upt_training.reduced.transfer import Source, interpolation


@pytest.fixture(scope="module")
def phantom(tmp_path_factory) -> tuple[Mesh, Columns, Path]:
    folder = tmp_path_factory.mktemp("reduced")
    mesh = box_mesh()
    mesh.save(folder / "box.mesh.safetensors")
    return mesh, write_columns(mesh, folder / "box.columns.safetensors"), folder


@pytest.fixture(scope="module")
def bundle(phantom) -> tuple[Path, Path]:
    """A bundle built by the command's own path, and its work folder."""
    mesh, columns, folder = phantom
    write_dataset(mesh, columns, folder / "data", 24)
    options = Options(
        mesh=folder / "box.mesh.safetensors",
        columns=columns.path,
        data=[folder / "data"],
        out=folder / "bundle",
        work=folder / "work",
        name="box-reduced",
        modes=12,
        response_modes=12,
        tolerance_mm=1e-3,
    )
    settings = Settings(hidden=48, updates=300, stages=[(4, 32, 0.5), (12, 16, 0.5)], validate_every=100)
    build(options, settings, "phantom")
    return options.out, options.work


def patch(columns: Columns, mesh: Mesh, count: int = 5) -> tuple[np.ndarray, np.ndarray]:
    points = mesh.positions[columns.contact_nodes]
    rows = np.sort(np.argsort(np.linalg.norm(points - points[len(points) // 2], axis=1), kind="stable")[:count])
    rng = np.random.default_rng(4)
    return columns.contact_nodes[rows], rng.normal(size=(count, 3)) + [0.5, 0.0, -3.0]


def test_blocks_hold_every_node_once_with_the_surface_first(phantom):
    mesh = phantom[0]
    surface = np.unique(mesh.surface)
    nodes, offsets = partition(mesh.positions, surface, 20)
    assert np.array_equal(np.sort(nodes), np.arange(mesh.node_count))
    assert np.diff(offsets).max() <= 20
    for start, end in zip(offsets[:-1], offsets[1:], strict=True):
        on_surface = np.isin(nodes[start:end], surface)
        assert np.array_equal(on_surface, np.sort(on_surface)[::-1])


def test_response_equals_a_direct_solve_with_prescribed_displacements(phantom, tmp_path):
    mesh, columns, _ = phantom
    prior, _ = make_prior(mesh, columns, tolerance_mm=1e-5)
    save_prior(tmp_path / "prior.safetensors", prior, np.float32)
    prior = load_prior(tmp_path / "prior.safetensors")
    nodes, vectors = patch(columns, mesh)
    found = prior.linear_response(nodes, vectors)

    stiffness = dense_stiffness(mesh)
    known = np.concatenate([nodes, mesh.fixed])
    values = np.concatenate([vectors, np.zeros((len(mesh.fixed), 3))]).ravel()
    known_dofs = (3 * known[:, None] + np.arange(3)).ravel()
    unknown = np.setdiff1d(np.arange(3 * mesh.node_count), known_dofs)
    exact = np.zeros(3 * mesh.node_count)
    exact[known_dofs] = values
    right = -stiffness[np.ix_(unknown, known_dofs)] @ values
    exact[unknown] = np.linalg.solve(stiffness[np.ix_(unknown, unknown)], right)
    assert np.abs(exact).max() > 1.0
    assert np.abs(found - exact.reshape(-1, 3)).max() < 2e-3
    assert np.abs(found[nodes] - vectors).max() < 2e-3


def test_block_basis_error_follows_the_tolerance_and_half_precision_is_enough(phantom, tmp_path):
    mesh, columns, _ = phantom
    errors, sizes = [], []
    for tolerance in (3e-2, 1e-3):
        prior, info = make_prior(mesh, columns, tolerance)
        errors.append(prior_error(mesh, columns, prior)["rms_mm"])
        sizes.append(info["coordinates"])
    assert errors[1] < 5e-3 and errors[1] < errors[0] and sizes[1] >= sizes[0]
    save_prior(tmp_path / "half.safetensors", prior, np.float16)
    assert prior_error(mesh, columns, load_prior(tmp_path / "half.safetensors"))["rms_mm"] < 1e-2


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_far_compliance_comes_out_of_the_response(phantom, tmp_path, dtype):
    mesh, columns, _ = phantom
    prior, _ = make_prior(mesh, columns, tolerance_mm=1e-3)
    points = mesh.positions[columns.contact_nodes].astype(np.float64)
    near = near_tensors(prior.compliance, points, 15.0)
    save_prior(tmp_path / "near.safetensors", prior, dtype, near)
    save_prior(tmp_path / "whole.safetensors", prior, dtype)
    assert (tmp_path / "near.safetensors").stat().st_size < (tmp_path / "whole.safetensors").stat().st_size
    found, whole = load_prior(tmp_path / "near.safetensors"), load_prior(tmp_path / "whole.safetensors")
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    apart = (found.compliance - whole.compliance).reshape(len(points), 3, len(points), 3)
    assert np.abs(apart).max(axis=(1, 3))[distance <= 15.0].max() == 0.0
    assert 0.0 < np.abs(apart).max() < 2e-3 * whole.compliance.max()
    # Two patches at a time: one is inside the radius, the other is not.
    rows = np.unique([*np.argsort(distance[0])[:4], *np.argsort(distance[-1])[:4]])
    vectors = np.random.default_rng(1).normal(size=(len(rows), 3)) * [1.0, 1.0, 0.3] - [0.0, 0.0, 5.0]
    fields = [p.linear_response(columns.contact_nodes[rows], vectors) for p in (found, whole)]
    assert np.sqrt(((fields[0] - fields[1]) ** 2).sum(1).mean()) < 0.02


def test_a_basis_made_in_parts_is_the_one_made_at_once(phantom):
    mesh, columns, _ = phantom
    forces = sample_forces(mesh, columns, 200)
    none, amplitudes = np.zeros((0, 3 * mesh.node_count), np.float32), np.zeros(0)
    made = [
        build_block_basis(mesh, columns, forces, none, amplitudes, size=24, memory_gib=memory)[0]
        for memory in (1.0, 12 * 200 * 50 / 2**30)
    ]
    assert len(groups(made[0], 200, 1.0)) == 1 < len(groups(made[0], 200, 12 * 200 * 50 / 2**30))
    dense = forces @ columns.columns
    for block, (whole, part) in enumerate(zip(made[0].bases, made[1].bases, strict=True)):
        field = dense[:, made[0].dofs(block)]
        assert whole.shape == part.shape
        for vectors in (whole, part):
            left = field - (field @ vectors) @ vectors.T
            assert np.sqrt((left**2).sum() / field.size * 3) < 4e-3  # the tolerance: 3e-3 mm a node
        assert np.allclose((field @ whole) @ whole.T, (field @ part) @ part.T, atol=1e-3)


def test_a_model_from_another_meshs_cases_alone(phantom, tmp_path):
    mesh, columns, folder = phantom
    fine = box_mesh(cells=(12, 10, 8), spacing_mm=5.0)
    fine.save(tmp_path / "fine.mesh.safetensors")
    fine_columns = write_columns(fine, tmp_path / "fine.columns.safetensors")
    write_dataset(mesh, columns, tmp_path / "coarse", 12)
    options = Options(
        mesh=tmp_path / "fine.mesh.safetensors",
        columns=fine_columns.path,
        data=[],
        out=tmp_path / "bundle",
        work=tmp_path / "work",
        name="fine",
        modes=8,
        response_modes=8,
        coarse_mesh=folder / "box.mesh.safetensors",
        coarse_columns=columns.path,
        coarse_data=[tmp_path / "coarse"],
    )
    build(options, Settings(updates=0, hidden=8, quadratic_modes=4), "from coarse cases")
    areas = json.loads((options.out / "bundle.json").read_text())["envelope"]["contact_area_mm2"]
    assert 0.0 < areas[0] < areas[1] < 1.25 * mesh.node_areas()[mesh.domain_nodes].sum()
    write_dataset(fine, fine_columns, tmp_path / "data", 4)
    errors = evaluate(options.out, open_dataset(tmp_path / "data", fine.sha256))
    assert errors["reduced"]["schemes_1_4"]["mse_mm2"] < errors["prior"]["schemes_1_4"]["mse_mm2"]


def test_interpolation_between_meshes_is_exact_for_linear_fields():
    coarse, fine = box_mesh((3, 3, 2), 20.0), box_mesh((5, 4, 3), 10.0)
    weights = interpolation(coarse, fine)
    gradient = np.array([[0.1, -0.2, 0.05], [0.0, 0.3, 0.1], [0.2, 0.0, -0.1]])
    field = coarse.positions @ gradient
    assert np.abs(weights @ field - fine.positions @ gradient).max() < 1e-3
    assert np.abs(np.asarray(weights.sum(axis=1)) - 1.0).max() < 1e-5


def test_states_of_another_meshs_cases_are_those_of_the_moved_fields(phantom, tmp_path):
    mesh, columns, _ = phantom
    fine = box_mesh(cells=(9, 8, 6), spacing_mm=6.5)
    write_dataset(mesh, columns, tmp_path / "coarse", 2)
    source = Source(columns, open_dataset(tmp_path / "coarse", mesh.sha256), interpolation(mesh, fine))
    rng = np.random.default_rng(2)
    modes = Modes(rng.normal(size=(5, source.width)), np.ones(5), rng.normal(size=(4, source.width)), np.ones(4))
    states = project_cases(source, modes)
    for at, case in enumerate(source.cases):
        linear, field = source.fields(case)
        assert np.allclose(states.b[at], (field - linear) @ modes.residual.T, atol=1e-3)
        assert np.allclose(states.z[at], linear @ modes.response.T, atol=1e-3)
        assert np.allclose(states.response_norm[at] ** 2, (linear**2).sum(1), rtol=1e-4, atol=1e-6)
        assert np.allclose(states.field_square[at], (field**2).sum(1), rtol=1e-4, atol=1e-6)


def test_columns_of_another_mesh_are_refused(phantom):
    mesh, columns, _ = phantom
    moved = Mesh(mesh.positions + 1.0, mesh.tets, mesh.surface, mesh.domain, mesh.fixed, mesh.supported)
    with pytest.raises(InputError, match="another mesh"):
        make_prior(moved, columns)


def test_any_correction_stays_inside_the_bound(bundle):
    states = load_states(bundle[1] / "states-data.npz")
    model = Correction(states.modes, states.z.shape[2], 16)
    torch.manual_seed(0)
    with torch.no_grad():
        model.contact_base.normal_(0, 3.0)
        model.free_base.normal_(0, 3.0)
    limits = Limits(relative=0.4, decay=0.8)
    norm = np.linalg.norm(rollout_from_rest(model, states, limits), axis=2)
    assert norm.max() > 0.1
    assert (norm <= true_limits(states, limits) * (1 + 1e-5) + 1e-6).all()
    assert norm[:, -1].max() < 0.8**15 * norm.max() * 20


def test_the_fade_ends_in_the_prior(bundle):
    states = load_states(bundle[1] / "states-data.npz")
    model = Correction(states.modes, states.z.shape[2], 16)
    with torch.no_grad():
        model.contact_base.fill_(0.1)
    drive = drive_of(states)
    drive.push = torch.full_like(drive.push, 70.0)
    zero = torch.zeros(states.cases, states.modes)
    assert rollout(model, drive, zero, zero, torch.zeros(states.cases), Limits()).abs().max() == 0.0


def test_the_bundle_runs_as_it_was_trained(phantom, bundle):
    mesh, _, folder = phantom
    out, work = bundle
    states = load_states(work / "states-data.npz")
    saved = torch.load(work / "training-1.pt", weights_only=True)["best"]
    model = Correction(states.modes, states.z.shape[2], 48)
    model.load_state_dict(saved)
    manifest = json.loads((out / "bundle.json").read_text())
    bound = manifest["reduced"]["bound"]
    expected = rollout_from_rest(
        model, states.pick(np.arange(states.cases) == 0), Limits(bound["relative"], bound["decay"])
    )
    runner = ReducedRunner(out)
    case = open_dataset(folder / "data", mesh.sha256)[0]
    for t in range(1, FRAMES):
        rows = slice(case.offsets[t], case.offsets[t + 1])
        field = runner.step(case.nodes[rows], case.vectors[rows])
        assert np.abs(runner.b - expected[0, t]).max() < 2e-3
        if rows.stop > rows.start:
            assert np.array_equal(field[case.nodes[rows]], case.vectors[rows])
        assert np.abs(field[mesh.fixed]).max() == 0.0


def test_the_correction_beats_the_prior_on_unseen_cases(phantom, bundle):
    mesh, _, folder = phantom
    cases = open_dataset(folder / "data", mesh.sha256, "test")
    result = evaluate(bundle[0], cases)
    prior, reduced = result["prior"]["schemes_1_4"], result["reduced"]["schemes_1_4"]
    assert reduced["mse_mm2"] < prior["mse_mm2"]
    assert prior["mse_mm2"] < result["zero"]["schemes_1_4"]["mse_mm2"]


def test_test_cases_and_scheme_5_are_never_trained_on(bundle):
    states = load_states(bundle[1] / "states-data.npz")
    states.scheme[0] = "5"
    fit, validation, tested = split_states(states)
    assert fit.cases + validation.cases + tested.cases == states.cases
    assert (fit.split == "train").all() and (fit.scheme != "5").all()
    assert (validation.split == "train").all() and (validation.scheme != "5").all()
    assert "5" in tested.scheme


def test_trajectories_of_another_damping_are_never_trained_on(phantom, bundle):
    mesh, _, folder = phantom
    cases = open_dataset(folder / "data", mesh.sha256, "train")
    assert len(trainable(cases)) == len(cases)
    cases[0].damping_per_s = 2.0
    assert [case.path for case in trainable(cases)] == [case.path for case in cases[1:]]
    states = load_states(bundle[1] / "states-data.npz")
    states.split[0] = "other"
    fit, validation, _ = split_states(states)
    assert states.source[0] not in [*fit.source, *validation.source, *training_states(states).source]


def test_coarse_cases_validate_where_fine_ones_are_too_few(bundle):
    states = load_states(bundle[1] / "states-data.npz")
    states.split = np.where(states.split == "train", "coarse", states.split)
    fit, validation, _ = split_states(states)
    assert validation.cases >= 2 and fit.cases > validation.cases
    assert not set(fit.source) & set(validation.source)


def test_fewer_modes_are_cut_from_the_same_build_and_floors_fall(phantom, bundle, tmp_path):
    mesh, columns, folder = phantom
    options = Options(
        mesh=folder / "box.mesh.safetensors",
        columns=columns.path,
        data=[folder / "data"],
        out=tmp_path / "cut",
        work=tmp_path / "work",
        name="cut",
        response_modes=12,
        tolerance_mm=1e-3,
    )
    text = sweep(options, Settings(updates=0, hidden=8), "phantom", [8, 4])
    few, many = ReducedRunner(tmp_path / "cut-4"), ReducedRunner(tmp_path / "cut-8")
    assert few.manifest["reduced"]["modes"] == 4 and many.manifest["reduced"]["modes"] == 8
    assert np.array_equal(few.prior.residual, many.prior.residual[:4])
    lines = text.splitlines()[2:]
    assert [line.split("|")[1].strip()[:5] for line in lines] == ["prior", "prior", "prior"]
    assert float(lines[2].split("|")[2]) < float(lines[0].split("|")[2])
    states = load_states(tmp_path / "work" / "states-data.npz")
    assert 0.0 < floor(states, 8, "schemes_1_4") < 0.8 * floor(states, 4, "schemes_1_4")


def test_compare_lists_every_method_of_every_regime_and_refuses_an_empty_one(phantom, bundle, tmp_path):
    _, _, folder = phantom
    regimes = [("seen", folder / "data")]
    text = compare(bundle[0], None, regimes, False, lambda label: lambda done, total: None)
    errors = {line.split("|")[3].strip(): float(line.split("|")[4].strip(" *")) for line in text.splitlines()[2:]}
    assert errors["reduced"] < errors["linear elasticity"] < errors["zero"]
    (tmp_path / "manifest.json").write_text('{"cases": []}')
    with pytest.raises(InputError, match="no finished case"):
        compare(bundle[0], None, [("none", tmp_path)], False, lambda label: lambda done, total: None)


def test_the_domain_beside_the_domain_shares_no_node_with_it(phantom):
    mesh = phantom[0]
    beside = beside_domain(mesh, 40.0)
    assert beside.sha256 == mesh.sha256 and len(beside.domain)
    assert not np.isin(beside.domain_nodes, mesh.domain_nodes).any()
    patches = patches_of_domain(mesh, 2, 5.0)
    assert 0 < len(patches.domain) < len(mesh.domain) and np.isin(patches.domain, mesh.domain).all()
    with pytest.raises(InputError, match="raise --beside"):
        beside_domain(mesh, 0.0)


def test_the_domain_around_the_worst_sites_is_where_the_error_is_largest(phantom, tmp_path):
    mesh = phantom[0]
    points = mesh.positions[mesh.domain_nodes].astype(float)
    bad, good = points[points[:, 0].argmin()], points[points[:, 0].argmax()]
    cases = [{"site": list(site), "bundle": {"mse_mm2": mse}} for site, mse in ((good, 0.01), (bad, 0.4), (good, 0.02))]
    evaluation = tmp_path / "evaluation.json"
    evaluation.write_text(json.dumps({"cases": [*cases, {"site": None, "bundle": {"mse_mm2": 9.0}}]}))
    found = worst_of_domain(mesh, evaluation, 0.3, 20.0)
    assert found.sha256 == mesh.sha256 and 0 < len(found.domain) < len(mesh.domain)
    centres = mesh.positions[mesh.surface[found.domain]].mean(axis=1)
    assert np.linalg.norm(centres - bad, axis=1).max() <= 20.0
    for text, share in (("{}", 0.3), ('{"cases": []}', 0.3), (evaluation.read_text(), 0.0)):
        evaluation.write_text(text)
        with pytest.raises(InputError, match="evaluation.json: "):
            worst_of_domain(mesh, evaluation, share)


def test_a_domain_with_columns_of_a_part_lends_to_the_nearest(phantom, bundle):
    mesh, columns, _ = phantom
    kept = columns.contact_nodes[::2]
    lender = Lender(mesh, kept, "fixed")
    own, beside = kept[:2], columns.contact_nodes[1]
    vectors = np.float32([[1, 0, 0], [0, 2, 0]])
    nodes, given = lender(own, vectors)
    assert np.array_equal(nodes, own) and np.array_equal(given, vectors)
    nodes, given = lender(np.array([beside]), vectors[:1])
    distance = np.linalg.norm(mesh.positions[kept] - mesh.positions[beside], axis=1)
    assert distance[kept == nodes[0]] == distance.min() and np.array_equal(given, vectors[:1])
    # A column's own node goes before the node that borrows it; held nodes lend nothing.
    pair = np.array([nodes[0], beside])
    assert np.array_equal(lender(pair, vectors)[1], vectors[:1])
    assert len(lender(mesh.fixed[:1], vectors[:1])[0]) == 0
    error = response_error(bundle[0], columns, mesh, 6)
    assert error["rms_mm"] < 0.05 * error["response_rms_mm"]
