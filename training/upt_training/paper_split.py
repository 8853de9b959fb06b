"""The paper's split of a bundle, for measurements: `python -m upt_training.paper_split BUNDLE --out FOLDER`.

`paper_encoder.onnx` (features -> a message an edge) and `paper_decoder.onnx` (mean messages -> the network's output at
all nodes) compute what the bundle's own graphs do, without anything that is computed once per mesh.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import onnx
import torch

from upt_training.bundle_folder import read_manifest
from upt_training.bundle_weights import bundle_state
from upt_training.config import settings_from_dict
from upt_training.errors import InputError
from upt_training.model import Upt
from upt_training.onnx_graph import paper_decoder_graph, paper_encoder_graph


def write_split(bundle: Path, out: Path) -> None:
    manifest = read_manifest(bundle)
    architecture = manifest["provenance"].get("architecture")
    if manifest["kind"] != "upt" or architecture is None:
        raise InputError(f"{bundle}: not of kind `upt` with its provenance.architecture")
    model = Upt(settings_from_dict({"name": manifest["name"], "model": architecture}, str(bundle)).model)
    model.load_state_dict(bundle_state(bundle, model))
    model.eval()
    out.mkdir(parents=True, exist_ok=True)
    with torch.no_grad():
        onnx.save(paper_encoder_graph(model), out / "paper_encoder.onnx")
        onnx.save(paper_decoder_graph(model), out / "paper_decoder.onnx")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m upt_training.paper_split", description=__doc__)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    try:
        write_split(options.bundle, options.out)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
