"""Writes a bundle folder (docs/reference/formats.md, "Bundle: a folder") and checks what it wrote.

The self-check runs the PyTorch model, the same model unfactored (per-edge messages, as in the paper) and the ONNX
graphs in ONNX Runtime on the same inputs; their relative difference must stay below 1e-5.
"""

from __future__ import annotations

import copy
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from safetensors.numpy import save_file

from upt_training import onnx_graph
from upt_training.bundle_folder import new_bundle, write_manifest
from upt_training.errors import InputError
from upt_training.graph import Graph, build_graph
from upt_training.half_weights import round_weights, store_in_half
from upt_training.mesh_file import Mesh
from upt_training.model import Upt
from upt_training.reference_step import write_reference

TOLERANCE = 1e-5
MATERIAL = {"young_pa": 3000.0, "poisson": 0.49, "density_kg_m3": 1000.0, "damping_per_s": 20.0}
ENVELOPE = {
    "max_push_mm": 15.0,
    "max_push_rate_mm": 3.0,
    "contact_area_mm2": [60.0, 280.0],
    "max_sites": 1,
    "displacement_bound_mm": 30.0,
}


def graphs_of(model: Upt, paper_split: bool, step: bool) -> dict[str, onnx.ModelProto]:
    graphs = {
        "embed.onnx": onnx_graph.embed_graph(model),
        "encoder.onnx": onnx_graph.encoder_graph(model),
        "latent.onnx": onnx_graph.latent_graph(model),
        "decoder.onnx": onnx_graph.decoder_graph(model),
    }
    if step:
        graphs["step.onnx"] = onnx_graph.step_graph(model)
    if paper_split:
        graphs["paper_encoder.onnx"] = onnx_graph.paper_encoder_graph(model)
        graphs["paper_decoder.onnx"] = onnx_graph.paper_decoder_graph(model)
    return graphs


def kernel_weights(model: Upt) -> dict[str, np.ndarray]:
    """`weights.safetensors`: what the native kernels read, matrices as `[out, in]`."""
    source, target = model.encoder_weights()
    d = model.decoder
    head_weight, head_bias = onnx_graph.scaled_head(model)
    tensors = {
        "encoder.source": source,
        "encoder.target": target,
        "decoder.attention_out.weight": d.proj.weight,
        "decoder.attention_out.bias": d.proj.bias,
        "decoder.norm2.weight": d.norm2.weight,
        "decoder.norm2.bias": d.norm2.bias,
        "decoder.mlp1.weight": d.mlp.fc1.weight,
        "decoder.mlp1.bias": d.mlp.fc1.bias,
        "decoder.mlp2.weight": d.mlp.fc2.weight,
        "decoder.mlp2.bias": d.mlp.fc2.bias,
        "decoder.norm3.weight": d.norm3.weight,
        "decoder.norm3.bias": d.norm3.bias,
        "decoder.head.weight": head_weight,
        "decoder.head.bias": head_bias,
    }
    return {k: np.ascontiguousarray(v.detach().cpu().numpy(), np.float32) for k, v in tensors.items()}


class BundleSession:
    """The graphs of a bundle folder in ONNX Runtime (CPU): the paper's step without the native kernels."""

    def __init__(self, folder: Path, mesh: Mesh, graph: Graph, suffix: str = ""):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1

        def session(name: str):
            path = folder / f"{name}{suffix}.onnx"
            path = path if path.exists() else folder / f"{name}.onnx"
            return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])

        self.encoder, self.latent, self.decoder = (
            session("encoder"),
            session("latent"),
            session("decoder"),
        )
        positions = mesh.positions.astype(np.float32)
        self.tables = session("embed").run(None, {"positions": positions})
        self.graph = graph
        self.targets = np.repeat(graph.supernodes, np.diff(graph.offsets))

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Normalised features `[K, f]` -> displacement `[K, 3]` mm, before `base`."""
        return self.decode(*self.keys_values(features))

    def keys_values(self, features: np.ndarray) -> list[np.ndarray]:
        inputs = {
            "features": features,
            "source_table": self.tables[0],
            "target_table": self.tables[1],
        }
        source, target = self.encoder.run(None, inputs)
        x = torch.from_numpy(source[self.graph.neighbours] + target[self.targets])
        edge = torch.nn.functional.gelu(x).numpy()
        mean = np.add.reduceat(edge, self.graph.offsets[:-1], axis=0)
        mean /= np.diff(self.graph.offsets)[:, None].astype(np.float32)
        return self.latent.run(None, {"supernodes": mean})

    def decode(self, keys: np.ndarray, values: np.ndarray, nodes: np.ndarray | None = None) -> np.ndarray:
        queries = self.tables[2] if nodes is None else self.tables[2][nodes]
        return self.decoder.run(None, {"queries": queries, "keys": keys, "values": values})[0]


def self_check(model: Upt, folder: Path, mesh: Mesh, graph: Graph, feature_sets: list[np.ndarray]) -> dict[str, float]:
    """Largest relative differences on the given features; raises when one is above `TOLERANCE`."""
    model = model.eval()
    session = BundleSession(folder, mesh, graph)
    neighbours, mask = (torch.from_numpy(a) for a in graph.padded())
    supernodes = torch.from_numpy(graph.supernodes)
    positions = torch.from_numpy(mesh.positions.astype(np.float32))
    out = {"onnxruntime_vs_pytorch": 0.0, "unfactored_vs_pytorch": 0.0}
    with torch.no_grad():
        source, target, query = model.tables(positions)
        for features in feature_sets:
            x = torch.from_numpy(features)
            ours = model(x, (source, target), neighbours, mask, supernodes, query).numpy()
            original = model.forward_unfactored(x, positions, neighbours, mask, supernodes).numpy()
            scale = float(np.abs(original).max())
            others = {
                "onnxruntime_vs_pytorch": session(features),
                "unfactored_vs_pytorch": original,
            }
            if (folder / "step.onnx").exists():
                others["step_vs_pytorch"] = _run_step(folder, session, graph, model, features)
            if (folder / "paper_encoder.onnx").exists():
                others["paper_split_vs_pytorch"] = run_paper_split(folder, mesh, graph, features)
            for name, value in others.items():
                out[name] = max(out.get(name, 0.0), float(np.abs(value - ours).max()) / scale)
    for name, value in out.items():
        if not value < TOLERANCE:
            raise InputError(f"{folder}: self-check {name}: relative difference {value:.2e} is not below {TOLERANCE}")
    return out


def _run_step(folder: Path, session: BundleSession, graph: Graph, model: Upt, features: np.ndarray) -> np.ndarray:
    neighbours, mask = graph.padded(model.settings.graph.max_degree)
    step = onnxruntime.InferenceSession(str(folder / "step.onnx"), providers=["CPUExecutionProvider"])
    inputs = {
        "features": features,
        "source_table": session.tables[0],
        "target_table": session.tables[1],
    }
    inputs |= {
        "query_table": session.tables[2],
        "neighbours": neighbours,
        "mask": mask,
        "supernodes": graph.supernodes,
    }
    return step.run(None, inputs)[0]


def run_paper_split(folder: Path, mesh: Mesh, graph: Graph, features: np.ndarray) -> np.ndarray:
    """The paper's layout: messages per edge, mean on the host, second half."""
    first = onnxruntime.InferenceSession(str(folder / "paper_encoder.onnx"), providers=["CPUExecutionProvider"])
    second = onnxruntime.InferenceSession(str(folder / "paper_decoder.onnx"), providers=["CPUExecutionProvider"])
    positions = mesh.positions.astype(np.float32)
    degree = np.diff(graph.offsets)
    inputs = {"features": features, "positions": positions, "edge_source": graph.neighbours}
    inputs["edge_target"] = np.repeat(graph.supernodes, degree)
    messages = first.run(None, inputs)[0]
    mean = np.add.reduceat(messages, graph.offsets[:-1], axis=0) / degree[:, None].astype(np.float32)
    return second.run(None, {"supernodes": mean, "positions": positions})[0]


def write_bundle(
    model: Upt,
    mesh: Mesh,
    out: Path,
    *,
    name: str,
    description: str,
    boundary: str = "fixed",
    material: dict | None = None,
    envelope: dict | None = None,
    prior: Path | None = None,
    vibration: Path | None = None,
    provenance: dict | None = None,
    errors: dict | None = None,
    paper_split: bool = False,
    step: bool = False,
    precisions: tuple[str, ...] = ("f32",),
    check_features: list[np.ndarray] | None = None,
    half_weights: bool = False,
) -> dict:
    """Write the folder `out` (made new beside it, then moved into place) and return its manifest.

    `half_weights` rounds large weights to half precision and stores those of `latent.onnx` so; it computes in float32.
    """
    out = Path(out)
    if model.settings.uses_prior and prior is None:
        raise InputError(f"{out}: the model's features or base use the prior: pass --prior prior.safetensors")
    if model.settings.vibration and vibration is None:
        raise InputError(f"{out}: the model uses free vibration: pass --vibration vibration.safetensors")
    model = model.eval().float().cpu()
    if half_weights:
        model = round_weights(copy.deepcopy(model))
    s = model.settings
    graph = build_graph(mesh, s.graph)
    with new_bundle(out) as folder:
        with torch.no_grad():
            exact = copy.deepcopy(model).double()
            for file, proto in graphs_of(exact, paper_split, step).items():
                if half_weights and file == "latent.onnx":
                    store_in_half(proto)
                onnx.save(proto, str(folder / file))
            save_file(kernel_weights(exact), str(folder / "weights.safetensors"))
        if paper_split and not s.uses_prior:
            write_reference(folder, model, mesh, graph)
        mesh.save(folder / "mesh.safetensors")
        if prior is not None and s.uses_prior:
            shutil.copyfile(prior, folder / "prior.safetensors")
        if s.vibration:
            shutil.copyfile(vibration, folder / "vibration.safetensors")
        generator = np.random.default_rng(0)
        random = generator.standard_normal((mesh.node_count, s.feature_count)).astype(np.float32)
        check = self_check(model, folder, mesh, graph, [random, *(check_features or [])])
        written = ["f32"]
        for precision in precisions:
            if precision != "f32":
                from upt_training.precision import write_variant

                write_variant(folder, precision)
                written.append(precision)
        manifest = {
            "format": "upt-bundle",
            "version": 1,
            "kind": "upt",
            "name": name,
            "description": description,
            "license": "MIT OR Apache-2.0",
            "dt_s": 0.05,
            "length_unit": "mm",
            "force_unit": "mN",
            "boundary": boundary,
            "material": material or MATERIAL,
            "mesh": {
                "file": "mesh.safetensors",
                "nodes": mesh.node_count,
                "mesh_sha256": mesh.sha256,
            },
            "envelope": envelope or ENVELOPE,
            "precisions": written,
            "upt": {
                "features": s.features,
                "base": s.base,
                "normalisation": {
                    "mean": model.feature_mean.tolist(),
                    "std": model.feature_std.tolist(),
                },
                "coordinates": {
                    "offset": model.coordinate_offset.tolist(),
                    "scale": float(model.coordinate_scale),
                },
                "graph": asdict(s.graph),
                "dims": {
                    "encoder": s.encoder,
                    "query": 2 * s.decoder,
                    "latent_tokens": s.latent_tokens,
                    "decoder": s.decoder,
                    "decoder_heads": s.decoder_heads,
                    "decoder_mlp": s.decoder * s.decoder_mlp_ratio,
                },
                "weights": "weights.safetensors",
            },
            "provenance": {
                "parameters": model.parameter_count(),
                **(provenance or {}),
                "export_check": check,
            },
            "errors": errors or {},
        }
        if prior is not None and s.uses_prior:
            manifest["prior"] = {"file": "prior.safetensors"}
        if s.vibration:
            manifest["prior"]["vibration"] = "vibration.safetensors"
        write_manifest(folder, manifest)
    return manifest
