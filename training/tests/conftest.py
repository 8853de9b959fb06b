"""Shared fixtures: a synthetic dataset on the box mesh, a short training run on it, and a run that ended elsewhere."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

sys.path.insert(0, str(Path(__file__).parent))

from synthetic import write_dataset  # noqa: E402

from upt_training.__main__ import main  # noqa: E402
from upt_training.config import load_settings  # noqa: E402
from upt_training.mesh_file import load_mesh  # noqa: E402
from upt_training.model import load_state  # noqa: E402
from upt_training.run import make_trainer  # noqa: E402

CONFIGS = Path(__file__).parents[1] / "configs"
CHECKPOINT = Path(__file__).parent / "fixtures" / "tiny-replay.safetensors"
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def data(tmp_path_factory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("box"))


@pytest.fixture(scope="session")
def mesh_path(data) -> Path:
    return data.parent / "box.mesh.safetensors"


@pytest.fixture(scope="session")
def trained(data, mesh_path, tmp_path_factory) -> Path:
    """A short replay run made here. Where it ends is this processor's rounding: only its loss may be judged."""
    out = tmp_path_factory.mktemp("run") / "replay"
    config = out.with_name("tiny-replay.toml")
    text = (CONFIGS / "tiny-replay.toml").read_text()
    whole, short = "\nepochs = 4\nautoregressive_epochs = 24\n", "\nepochs = 3\nautoregressive_epochs = 5\n"
    assert whole in text
    config.write_text(text.replace(whole, short))
    arguments = [
        "train",
        "--config",
        str(config),
        "--data",
        str(data),
        "--mesh",
        str(mesh_path),
    ]
    assert main([*arguments, "--out", str(out), "--device", "cpu"]) == 0
    return out


@pytest.fixture(scope="session")
def committed(data, mesh_path, tmp_path_factory) -> Path:
    """The run folder of a network trained elsewhere (`scripts/make_checkpoint.py`): the same on every machine."""
    out = tmp_path_factory.mktemp("committed") / "replay"
    out.mkdir()
    shutil.copyfile(CONFIGS / "tiny-replay.toml", out / "config.toml")
    trainer = make_trainer(load_settings(out / "config.toml"), data, load_mesh(mesh_path), None, out, "cpu")
    load_state(trainer.model, load_file(str(CHECKPOINT)), str(CHECKPOINT))
    trainer.save("best.pt")
    return out
