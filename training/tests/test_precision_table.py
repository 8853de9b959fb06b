"""The table of precisions: its rollouts are those of `evaluate`, one step's error is that of the graphs."""

import importlib.util
import json
from pathlib import Path

import pytest
from conftest import CONFIGS

from upt_training.__main__ import main
from upt_training.random_bundle import main as write_random

SCRIPT = Path(__file__).parents[1] / "tables/precision.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("precision_table", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_rows_are_rollouts_of_each_precision(script, data, mesh_path, tmp_path):
    bundle, page = tmp_path / "bundle", tmp_path / "page.md"
    write_random(["--config", str(CONFIGS / "tiny.toml"), "--mesh", str(mesh_path), "--out", str(bundle)])
    rows = script.rows_of_bundle(bundle, data, 1)
    assert [row[1] for row in rows] == ["f32", "f16", "int8"]
    assert main(["evaluate", str(bundle), "--data", str(data), "--count", "1", "--out", str(page)]) == 0
    wanted = json.loads(page.read_text())["all"]["bundle"]
    assert rows[0][2] == f"{wanted['mse_mm2']['mean']:.4f} ± 0.0000"
    assert rows[0][3] == f"{wanted['max_mm']['mean']:.3f} ± 0.000"
    half, int8 = (float(row[4]) for row in rows[1:])
    assert 0 < half < 0.01 and half < int8 < 0.5
    assert 0 < float(rows[1][5]) < float(rows[2][5])
    assert int(rows[1][6]) < int(rows[0][6])
