"""Makes the fixtures shared with the Rust tests: `python training/scripts/make_fixtures.py` from the repository root.

tests/fixtures/box.mesh.safetensors   a box of 210 nodes
tests/fixtures/graph.safetensors      supernodes and radius graphs of that box for three settings
tests/fixtures/tiny-upt/              a bundle with random weights on the box
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from upt_training import random_bundle
from upt_training.box_mesh import box_mesh
from upt_training.config import GraphSettings
from upt_training.graph import build_graph, node_keys

ROOT = Path(__file__).resolve().parents[2]
CASES = (
    GraphSettings(radius_mm=14.0, max_degree=8, supernodes=48, seed=7, domain_fraction=0.25),
    GraphSettings(radius_mm=25.0, max_degree=32, supernodes=64, seed=123456789, domain_fraction=0.0),
    GraphSettings(radius_mm=10.0, max_degree=4, supernodes=1000, seed=0, domain_fraction=0.5),
)


def main() -> None:
    fixtures = ROOT / "tests" / "fixtures"
    fixtures.mkdir(parents=True, exist_ok=True)
    mesh = box_mesh()
    mesh.save(fixtures / "box.mesh.safetensors")
    tensors = {
        "positions": mesh.positions,
        "domain_nodes": mesh.domain_nodes.astype(np.int32),
        "keys_seed7": node_keys(mesh.node_count, 7).view(np.int64),
    }
    for i, settings in enumerate(CASES):
        graph = build_graph(mesh, settings)
        tensors[f"case{i}.supernodes"] = graph.supernodes.astype(np.int32)
        tensors[f"case{i}.offsets"] = graph.offsets.astype(np.int32)
        tensors[f"case{i}.neighbours"] = graph.neighbours.astype(np.int32)
    metadata = {"cases": json.dumps([vars(c) for c in CASES])}
    save_file(tensors, str(fixtures / "graph.safetensors"), metadata=metadata)
    (fixtures / "graph.safetensors").chmod(0o644)
    config, out = ROOT / "training/configs/tiny.toml", fixtures / "tiny-upt"
    code = random_bundle.main(
        [
            "--config",
            str(config),
            "--mesh",
            str(fixtures / "box.mesh.safetensors"),
            "--out",
            str(out),
            "--step",
        ]
    )
    raise SystemExit(code)


if __name__ == "__main__":
    main()
