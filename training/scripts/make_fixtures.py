"""Makes the fixtures shared with the Rust tests: `python training/scripts/make_fixtures.py` from the repository root.

tests/fixtures/box.mesh.safetensors   a box of 210 nodes
tests/fixtures/graph.safetensors      supernodes and radius graphs of that box for three settings
tests/fixtures/tiny-upt/              a bundle with random weights on the box
tests/fixtures/tiny-upt-prior/        one that adds to the linear response of tiny-reduced/, with vibration and anchors
tests/fixtures/tiny-upt-prior-rollout.safetensors   a rollout of it through ONNX Runtime and numpy
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from upt_training import random_bundle, vibration
from upt_training.anchors import add_to_bundle
from upt_training.box_mesh import box_mesh
from upt_training.bundle_rollout import BundleRunner
from upt_training.config import GraphSettings
from upt_training.graph import build_graph, node_keys

# About a third of the box's nodes.
ANCHOR_SPACING_MM = 12.0
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
    random("tiny", fixtures / "tiny-upt", "--step")
    prior = fixtures / "tiny-reduced" / "prior.safetensors"
    with tempfile.TemporaryDirectory() as folder:
        swings = Path(folder) / "vibration.safetensors"
        arguments = ["--mesh", str(fixtures / "box.mesh.safetensors"), "--prior", str(prior), "--modes", "12"]
        if vibration.main([*arguments, "--out", str(swings)]):
            raise SystemExit(1)
        bundle = fixtures / "tiny-upt-prior"
        random("tiny-prior", bundle, "--prior", str(prior), "--vibration", str(swings), "--step")
    add_to_bundle(bundle, spacing_mm=ANCHOR_SPACING_MM, per_node=8)
    save_rollout(bundle, mesh, fixtures / "tiny-upt-prior-rollout.safetensors")


def random(config: str, out: Path, *more: str) -> None:
    """A bundle with random weights on the box."""
    box = ROOT / "tests" / "fixtures" / "box.mesh.safetensors"
    files = ["--config", str(ROOT / f"training/configs/{config}.toml"), "--mesh", str(box), "--out", str(out)]
    if random_bundle.main([*files, *more]):
        raise SystemExit(1)


def save_rollout(bundle: Path, mesh, path: Path) -> None:
    """30 steps: a push that grows, slides to other nodes, is released, and touches again while the tissue swings."""
    domain = np.setdiff1d(mesh.domain_nodes, mesh.fixed)
    centre = mesh.positions[domain].mean(axis=0)
    near = domain[np.argsort(np.linalg.norm(mesh.positions[domain] - centre, axis=1), kind="stable")]
    first, second = np.sort(near[:4]), np.sort(near[1:6])
    runner, rows, fields = BundleRunner(bundle), [], []
    for t in range(30):
        nodes = first if t < 6 else second if t < 12 else first[:0] if t < 22 else first[:2]
        push = min(t + 1, 8) * 0.9 * np.array([0.2, -0.1, -1.0], np.float32)
        rows.append((nodes, np.tile(push, (len(nodes), 1)).astype(np.float32)))
        fields.append(runner.step(*rows[-1]))
    tensors = {
        "displacement": np.stack(fields),
        "contact_offsets": np.cumsum([0, *(len(nodes) for nodes, _ in rows)]).astype(np.int32),
        "contact_nodes": np.concatenate([nodes for nodes, _ in rows]).astype(np.int32),
        "contact_vectors": np.concatenate([vectors for _, vectors in rows]),
    }
    save_file(tensors, str(path))
    path.chmod(0o644)


if __name__ == "__main__":
    main()
