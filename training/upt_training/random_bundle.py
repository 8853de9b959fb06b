"""Bundles with random weights, for tests and run-time measurements: `python -m upt_training.random_bundle`.

Such a bundle has the right shapes and a bounded output, and predicts nothing.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from upt_training.bundle import write_bundle
from upt_training.config import load_settings
from upt_training.errors import InputError
from upt_training.mesh_file import load_mesh
from upt_training.model import Upt


def random_model(settings, mesh, seed: int) -> Upt:
    """Weights three times wider than at the start of training, so that every path of the network matters."""
    torch.manual_seed(seed)
    model = Upt(settings.model)
    with torch.no_grad():
        for name, value in model.named_parameters():
            if value.ndim == 2:
                value.mul_(3.0)
            elif name.endswith("bias"):
                value.normal_(std=0.02)
    model.set_normalisation(np.full(3, 0.01), np.full(3, 1.5), np.full(3, 1.0))
    model.set_coordinates(mesh.positions)
    return model.eval()


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m upt_training.random_bundle", description=__doc__)
    parser.add_argument("--config", type=Path, required=True)
    parser.add_argument("--mesh", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--name")
    parser.add_argument("--prior", type=Path)
    parser.add_argument("--vibration", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--paper-split",
        action="store_true",
        help="also write paper_encoder.onnx, paper_decoder.onnx and, in float64, reference.safetensors",
    )
    parser.add_argument("--step", action="store_true", help="also write step.onnx")
    options = parser.parse_args(arguments)
    try:
        settings, mesh = load_settings(options.config), load_mesh(options.mesh)
        model = random_model(settings, mesh, options.seed)
        manifest = write_bundle(
            model,
            mesh,
            options.out,
            name=options.name or options.out.name,
            description=f"random weights, seed {options.seed}: shapes only, predicts nothing",
            prior=options.prior,
            vibration=options.vibration,
            provenance={
                "random_weights": True,
                "seed": options.seed,
                "architecture": asdict(settings.model),
            },
            paper_split=options.paper_split,
            step=options.step,
        )
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    total = sum(f["bytes"] for f in manifest["files"].values())
    print(f"{options.out}: {manifest['provenance']['parameters']} parameters, {total / 1e3:.0f} kB, "
          f"check {manifest['provenance']['export_check']}")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
