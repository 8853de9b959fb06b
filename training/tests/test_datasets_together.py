"""Several datasets at once: schemes and tools, whose cases have different lengths."""

import json
import shutil

import numpy as np
import pytest
import torch
from conftest import CONFIGS
from synthetic import write_dataset

from upt_training.config import load_settings
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.rollout import autoregressive_scores, cache_rollout
from upt_training.run import make_trainer


@pytest.fixture(scope="module")
def shorter(tmp_path_factory):
    return write_dataset(tmp_path_factory.mktemp("shorter"), frames=9, seed=5)


def made(data, mesh_path, folder, config="tiny-replay.toml"):
    return make_trainer(load_settings(CONFIGS / config), data, load_mesh(mesh_path), None, folder, "cpu")


def test_cases_of_both_datasets_are_scored_as_if_alone(data, shorter, mesh_path, tmp_path):
    both = made([data, shorter], mesh_path, tmp_path)
    assert both.train_cache.case_count == 16 and both.test_cache.case_count == 4
    assert sorted(both.test_cache.frames) == [9, 9, 21, 21]
    together = cache_rollout(both.stepper, both.test_cache, np.arange(4))
    parts = []
    for folder in (data, shorter):
        alone = made(folder, mesh_path, tmp_path)
        alone.stepper.model = both.model
        parts.append(cache_rollout(alone.stepper, alone.test_cache, np.arange(2)))
    for name, values in together.items():
        assert values.shape == (4, 20) and np.isnan(values[2:, 8:]).all()
        assert np.allclose(values[:2], parts[0][name], rtol=1e-4) and np.allclose(
            values[2:, :8], parts[1][name], rtol=1e-4
        )
    scores = [autoregressive_scores(part)["mse_mm2"] for part in parts]
    assert np.isclose(autoregressive_scores(together)["mse_mm2"], np.mean(scores), rtol=1e-4)


@pytest.mark.parametrize("config", ["tiny-replay.toml", "tiny.toml"])
def test_no_window_goes_beyond_the_end_of_its_case(config, data, shorter, mesh_path, tmp_path):
    trainer = made([data, shorter], mesh_path, tmp_path, config)
    cache, seen = trainer.train_cache, []
    read = cache.fields

    def watched(case, frame):
        seen.append((np.array(case), np.array(frame)))
        return read(case, frame)

    cache.fields = watched
    for _ in range(60):
        trainer.train_step()
    case, frame = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    assert (frame < cache.frames[case]).all()
    last = {length: frame[cache.frames[case] == length].max() for length in (9, 21)}
    assert last == {9: 8, 21: 20}, "both kinds of cases are trained on to their end"


def test_cases_in_memory_are_those_of_the_files(data, shorter, mesh_path, tmp_path):
    trainer = made([data, shorter], mesh_path, tmp_path)
    cache, case = trainer.train_cache, np.arange(16)
    frame = cache.frames - 1 - case % 3
    from_files = cache.fields(case, frame)
    assert cache.hold(1.0, torch.device("cpu"))
    for name, values in cache.fields(case, frame).items():
        assert torch.equal(values, from_files[name])


def test_datasets_of_two_boundaries_are_refused(data, shorter, mesh_path, tmp_path):
    other = tmp_path / "supported"
    shutil.copytree(shorter, other)
    manifest = json.loads((other / "manifest.json").read_text())
    (other / "manifest.json").write_text(json.dumps(manifest | {"boundary": "supported"}))
    with pytest.raises(InputError, match="supported: boundary 'supported', but .* has 'fixed'; train on one"):
        made([data, other], mesh_path, tmp_path)
