"""Makes the small trained network of the tests: `python training/scripts/make_checkpoint.py` from the repository root.

training/tests/fixtures/tiny-replay.safetensors   weights of `tiny-replay.toml` after its training on the synthetic data

Where a training run ends depends on rounding, and so on the processor. Tests that ask what a trained network does
take this one, which is the same everywhere.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from safetensors.torch import save_file

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "training" / "tests"))

from synthetic import write_dataset  # noqa: E402

from upt_training.__main__ import main as command  # noqa: E402
from upt_training.trainer import load_checkpoint  # noqa: E402


def main() -> None:
    out = ROOT / "training" / "tests" / "fixtures" / "tiny-replay.safetensors"
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        data = write_dataset(Path(folder))
        arguments = ["train", "--config", str(ROOT / "training/configs/tiny-replay.toml"), "--data", str(data)]
        arguments += ["--mesh", str(data.parent / "box.mesh.safetensors"), "--out", str(run), "--device", "cpu"]
        if command(arguments):
            raise SystemExit(1)
        weights = load_checkpoint(run / "best.pt")["model"]
    out.parent.mkdir(exist_ok=True)
    save_file({name: value.contiguous() for name, value in weights.items()}, str(out))
    out.chmod(0o644)


if __name__ == "__main__":
    main()
