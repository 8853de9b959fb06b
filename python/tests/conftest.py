"""The small bundles of tests/fixtures and the coarse brain."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import upt

ROOT = Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "tests" / "fixtures"


@pytest.fixture(scope="session", params=["tiny-reduced", "tiny-upt-prior"])
def name(request) -> str:
    """Each of the two kinds of bundle."""
    return request.param


@pytest.fixture(scope="session")
def model(name) -> upt.Model:
    return upt.Model(FIXTURES / name)


@pytest.fixture
def scene(model) -> upt.Scene:
    with model.scene(sleep=False) as scene:
        yield scene


def tensors(path: Path) -> dict[str, np.ndarray]:
    """A safetensors file."""
    data = path.read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    types = {"F32": np.float32, "I32": np.int32}
    found = {}
    for key, entry in json.loads(data[8 : 8 + length]).items():
        if key != "__metadata__":
            begin, end = (8 + length + offset for offset in entry["data_offsets"])
            found[key] = np.frombuffer(data[begin:end], types[entry["dtype"]]).reshape(entry["shape"])
    return found


def push(model: upt.Model, step: int, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """A push of some domain nodes that grows with the step."""
    depth = 0.2 * (step + 1)
    return model.domain_nodes[:count], np.tile(np.float32([0.1 * depth, 0.0, -depth]), (count, 1))
