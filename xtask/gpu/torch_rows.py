"""PyTorch on the card, eager and compiled, with the weights of random bundles:
`torch_rows.py OUT STEPS KINDS BUNDLE...`.

Needs torch and the packed `upt_training`. Also measures the card's rates for the floor: float32 products without TF32,
and copies. What cannot run is a line under `not_measured`.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np


def main(out: str, steps: str, kinds: str, *bundles: str) -> None:
    result = {"rows": [], "not_measured": []}
    try:
        import torch
    except ImportError as error:
        result["not_measured"] = [{"what": f"PyTorch {kind}", "why": str(error)} for kind in kinds.split(",")]
        result["not_measured"].append({"what": "the card's rates", "why": str(error)})
        Path(out).write_text(json.dumps(result))
        return
    device = "cuda" if torch.cuda.is_available() else "cpu"
    torch.backends.cuda.matmul.allow_tf32 = False
    torch.backends.cudnn.allow_tf32 = False
    if device == "cuda":
        result["card"] = rates(torch)
    else:
        result["not_measured"].append({"what": "the card's rates", "why": "torch finds no CUDA device"})
    Path(out).write_text(json.dumps(result))
    for bundle in bundles:
        for kind in kinds.split(","):
            try:
                result["rows"].append(row(torch, device, Path(bundle), kind, int(steps)))
            except Exception as error:  # a rival that fails leaves the other rows
                why = f"{type(error).__name__}: {error}".splitlines()[0][:300]
                result["not_measured"].append({"what": f"{Path(bundle).name}, PyTorch {kind}", "why": why})
            # Compiling may take long or end the process: what was measured before stays.
            Path(out).write_text(json.dumps(result))


def rates(torch) -> dict:
    a, b = (torch.randn(8192, 8192, device="cuda") for _ in range(2))
    x, y = (torch.empty(256 << 20, device="cuda") for _ in range(2))
    product = median(torch, "cuda", lambda: a @ b, 20)
    copy = median(torch, "cuda", lambda: y.copy_(x), 20)
    # A copy reads and writes each of its bytes.
    return {
        "name": torch.cuda.get_device_name(),
        "gflops": 2e-6 * 8192**3 / product,
        "gb_s": 2e-6 * x.numel() * 4 / copy,
    }


def times(torch, device: str, call, count: int) -> np.ndarray:
    out = []
    for i in range(count + 10):
        start = time.perf_counter()
        call()
        if device == "cuda":
            torch.cuda.synchronize()
        if i >= 10:
            out.append(1e3 * (time.perf_counter() - start))
    return np.array(out)


def median(torch, device: str, call, count: int) -> float:
    return float(np.median(times(torch, device, call, count)))


def row(torch, device: str, bundle: Path, kind: str, steps: int) -> dict:
    """One step: host arrays up, the network over all nodes, the displacement back."""
    from upt_training.config import settings_from_dict
    from upt_training.graph import build_graph
    from upt_training.mesh_file import load_mesh
    from upt_training.random_bundle import random_model

    manifest = json.loads((bundle / "bundle.json").read_text())
    provenance = manifest["provenance"]
    if not provenance.get("random_weights"):
        raise ValueError("the weights of this bundle cannot be made again")
    mesh = load_mesh(bundle / "mesh.safetensors")
    settings = settings_from_dict({"name": "", "description": "", "model": provenance["architecture"]}, str(bundle))
    model = random_model(settings, mesh, provenance["seed"]).to(device)
    graph = build_graph(mesh, settings.model.graph)
    neighbours, mask = (torch.from_numpy(a).to(device) for a in graph.padded())
    supernodes = torch.from_numpy(graph.supernodes).to(device)
    positions = torch.from_numpy(mesh.positions.astype(np.float32)).to(device)
    features = torch.randn(mesh.node_count, settings.model.feature_count)
    with torch.inference_mode():
        source, target, query = model.tables(positions)
        network = torch.compile(model) if kind == "compiled" else model
        call = lambda: network(features.to(device), (source, target), neighbours, mask, supernodes, query).cpu()  # noqa: E731
        found = times(torch, device, call, steps)
    p50, p95, p99 = np.percentile(found, [50, 95, 99])
    return {
        "bundle": manifest["name"],
        "variant": f"PyTorch {kind}",
        "provider": device,
        "nodes": "all",
        "scenes": 1,
        "node_count": mesh.node_count,
        "p50_ms": float(p50),
        "p95_ms": float(p95),
        "p99_ms": float(p99),
        "steps": len(found),
    }


if __name__ == "__main__":
    main(*sys.argv[1:])
