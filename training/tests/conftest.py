"""Shared fixtures: a synthetic dataset on the box mesh and one short training run on it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import torch

sys.path.insert(0, str(Path(__file__).parent))

from synthetic import write_dataset  # noqa: E402

from upt_training.__main__ import main  # noqa: E402

CONFIGS = Path(__file__).parents[1] / "configs"
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def data(tmp_path_factory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("box"))


@pytest.fixture(scope="session")
def mesh_path(data) -> Path:
    return data.parent / "box.mesh.safetensors"


@pytest.fixture(scope="session")
def trained(data, mesh_path, tmp_path_factory) -> Path:
    """A replay run long enough to beat predicting zero."""
    out = tmp_path_factory.mktemp("run") / "replay"
    arguments = [
        "train",
        "--config",
        str(CONFIGS / "tiny-replay.toml"),
        "--data",
        str(data),
        "--mesh",
        str(mesh_path),
    ]
    assert main([*arguments, "--out", str(out), "--device", "cpu"]) == 0
    return out
