"""Narrower tables of finished bundles: results stay, the body is shared, bodies that differ are refused."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from upt_training.bundle_folder import file_of, read_manifest, seal
from upt_training.bundle_rollout import BundleRunner
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.reduced.narrow import narrow
from upt_training.reduced.ragged import ragged_tensors, whole_response
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.step_tables import step
from upt_training.reduced.stepped import in_numbers, packed, quarters, unpacked, widths_of

FIXTURES = Path(__file__).parents[2] / "tests/fixtures"
BUNDLES = [FIXTURES / "tiny-corrected", FIXTURES / "tiny-upt-prior"]


def rollout(runner, steps=6):
    nodes = load_mesh(FIXTURES / "box.mesh.safetensors").domain_nodes[-4:]
    vectors = np.tile(np.array([[0.2, -0.1, -1.0]], np.float32), (4, 1))
    return np.stack([np.array(runner.step(nodes, vectors * (t + 1))) for t in range(steps)])


@pytest.mark.parametrize("one_space", [False, True])
def test_rollouts_stay_and_the_body_lies_once(tmp_path, one_space):
    about = narrow(BUNDLES, tmp_path, tolerance_mm=1e-5, near_mm=1e3, drop=0.0, one_space=one_space)
    assert about["rms_mm"] < 1e-4
    body, other = tmp_path / "tiny-corrected", tmp_path / "tiny-upt-prior"
    assert read_manifest(other)["body"] == "tiny-corrected" and "body" not in read_manifest(body)
    assert not (other / "prior.safetensors").exists() and not (other / "mesh.safetensors").exists()
    for bundle, runner in zip((body, other), (ReducedRunner, BundleRunner), strict=True):
        old, new = rollout(runner(FIXTURES / bundle.name)), rollout(runner(bundle))
        assert np.abs(new - old).max() < 2e-3 * np.abs(old).max()
        manifest = read_manifest(bundle)
        for name, entry in manifest["files"].items():
            assert file_of(bundle, manifest, name).stat().st_size == entry["bytes"], name
    tables = load_file(body / "corrections.safetensors")
    assert np.allclose(tables["stiffness"], tables["stiffness"].T)
    old = load_file(BUNDLES[0] / "corrections.safetensors")
    for name in ("stiffness", "mass"):
        assert np.abs(tables[name] - old[name]).max() < 1e-2 * np.abs(old[name]).max(), name


def test_what_a_node_does_not_reach_is_left_out():
    rng = np.random.default_rng(3)
    ranks = np.array([0, 16, 24])
    response = rng.standard_normal((6, 24)).astype(np.float16)
    response[:3, 8:16] = 1e-4
    response[3:, 16:] = 0.0
    tensors = ragged_tensors(response.astype(np.float32), ranks, 1e-2) | {"rank_offsets": ranks}
    assert tensors["response_ranks"].tolist() == [[1, 1], [2, 0]]
    assert tensors["response"].shape == (3 * 8 * 4,)
    expected = response.copy()
    expected[:3, 8:16] = 0.0
    assert np.array_equal(whole_response(tensors), expected)


def test_codes_of_every_width_come_back():
    groups = [np.zeros(8, int), np.array([7, -7, 0, 1, -1, 2, 3, -3]), np.arange(-120, 120, 10), np.full(8, -32767)]
    data, widths = packed(groups)
    assert widths.tolist() == [0, 1, 2, 3] and len(data) == 4 + 24 + 16
    assert np.array_equal(widths_of(quarters(np.append(widths, 3)), 5), [0, 1, 2, 3, 3])
    for own, found in zip(groups, unpacked(data, widths, np.array([8, 8, 24, 8])), strict=True):
        assert np.array_equal(own, found)
    with pytest.raises(InputError, match="group 0 has a code of 32768"):
        packed([np.full(8, 32768)])


def test_tables_in_steps_give_the_same_rollouts_for_a_body_and_its_predictors(tmp_path):
    narrow(BUNDLES, tmp_path / "narrow", tolerance_mm=1e-5, near_mm=1e3, drop=0.0, one_space=True)
    bundles = [tmp_path / "narrow" / bundle.name for bundle in BUNDLES]
    about = step(bundles, tmp_path / "out", response_step=1e-4, basis_mm=1e-4, mode_mm=1.0)
    assert about["bytes"] < (bundles[0] / "prior.safetensors").stat().st_size
    old, new = (
        load_file(folder / BUNDLES[0].name / "prior.safetensors") for folder in (bundles[0].parent, tmp_path / "out")
    )
    numbers = in_numbers(new)
    assert np.abs(numbers["response"] - whole_response(old).astype(float)).max() < 1e-4
    for bundle, runner in zip(bundles, (ReducedRunner, BundleRunner), strict=True):
        before, after = rollout(runner(bundle)), rollout(runner(tmp_path / "out" / bundle.name))
        assert np.abs(after - before).max() < 5e-3 * np.abs(before).max()
    assert not (tmp_path / "out" / BUNDLES[1].name / "prior.safetensors").exists()


def test_bundles_of_another_body_are_refused(tmp_path):
    other = tmp_path / "other"
    shutil.copytree(BUNDLES[1], other)
    material = read_manifest(other)["material"] | {"young_pa": 9000.0}
    seal(other, {"material": material})
    before = json.loads((other / "bundle.json").read_text())
    with pytest.raises(InputError, match="other/bundle.json: material is another"):
        narrow([BUNDLES[0], other], tmp_path / "out")
    assert json.loads((other / "bundle.json").read_text()) == before and not (tmp_path / "out").exists()
    seal(other, {"prior": None})
    with pytest.raises(InputError, match="no linear response"):
        narrow([other], tmp_path / "out")
