"""`scripts/train_on_gpu.sh`, rehearsed on the CPU: slices by time, two processes, export and evaluation at the end."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from conftest import CONFIGS

from upt_training.config import load_settings
from upt_training.dataset import map_safetensors
from upt_training.trainer import load_checkpoint

SCRIPT = Path(__file__).parents[1] / "scripts" / "train_on_gpu.sh"


def call(config: Path, data: Path, mesh: Path, out: Path, **environment: str) -> str:
    settings = {"DEVICE": "cpu", "PYTHON": sys.executable, "OMP_NUM_THREADS": "1", **environment}
    done = subprocess.run(
        ["bash", str(SCRIPT), str(config), str(data), str(mesh), str(out)],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_slice_of_two_processes_ends_together_and_the_next_slice_finishes_and_exports(data, mesh_path, tmp_path):
    out, config = tmp_path / "run", tmp_path / "short.toml"
    levers = "scored_rows = 40\ndrawn_supernodes = 24\nbf16 = true\nresident_gb = 1.0\n"
    config.write_text((CONFIGS / "tiny.toml").read_text() + "steps_per_epoch = 5\n" + levers)
    first = call(config, data, mesh_path, out, GPUS="2", SLICE_MINUTES="0.0001")
    assert "time limit at step 1;" in first and (out / "last.pt").exists() and not (out / "bundle").exists()
    second = call(config, data, mesh_path, out, SLICE_MINUTES="9")
    assert "from step 1," in second and "finished at step 40" in second
    manifest = json.loads((out / "bundle" / "bundle.json").read_text())
    assert manifest["provenance"]["steps"] > 0 and (out / "bundle" / "step.onnx").exists()
    assert len(json.loads((out / "evaluation.json").read_text())["cases"]) == 2
    refined = tmp_path / "refined"
    call(config, data, mesh_path, refined, SLICE_MINUTES="0.0001", INIT=str(out / "bundle"))
    # One step away from the bundle; a fresh start would be forty away.
    found = load_checkpoint(refined / "last.pt")["model"]["decoder.mlp.fc1.weight"]
    apart = found.numpy() - map_safetensors(out / "bundle/weights.safetensors")[0]["decoder.mlp1.weight"]
    assert np.abs(apart).max() < 2 * load_settings(config).train.learning_rate
