"""The Gymnasium environment and the notebook run, and do what they say."""

from __future__ import annotations

import importlib.util
import json
import warnings

import numpy as np
import pytest
import upt
from conftest import ROOT

EXAMPLES = ROOT / "python" / "examples"


@pytest.fixture(scope="module")
def example():
    specification = importlib.util.spec_from_file_location("push_point", EXAMPLES / "push_point.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def model():
    return upt.Model(ROOT / "onnx" / "brain-coarse-reduced")


@pytest.fixture
def environment(example, model):
    environment = example.PushPoint(model)
    yield environment
    environment.close()


def test_gymnasium_accepts_the_environment(environment):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*not within the observation space.*|.*render.*|.*spec.*")
        check_env(environment, skip_render_check=True)


def test_a_learned_policy_beats_a_random_one(example, environment, model):
    environment.action_space.seed(0)
    held_out = range(10_000, 10_008)
    random = example.play(environment, lambda _: environment.action_space.sample(), held_out)
    learned = example.play(environment, example.learn(example.PushPoint(model, corrections=1), rounds=3), held_out)
    assert learned < 0.8 * random, f"{learned} mm against {random} mm"


def test_pushing_towards_the_goal_arrives(example, environment):
    """A hand-made policy: the point follows the patch, so what is missing is pushed on."""
    still = example.play(environment, lambda _: np.zeros(3), range(5))
    assert example.play(environment, example.LinearPolicy(np.eye(3)), range(5)) < 0.3 * still


def test_the_notebook_runs(monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(EXAMPLES)
    cells = json.loads((EXAMPLES / "dent.ipynb").read_text())["cells"]
    variables: dict = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), variables)
    assert variables["deepest"] > 3.0
