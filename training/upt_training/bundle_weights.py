"""`train --init BUNDLE`: the weights of a finished bundle, to train on from them on any mesh.

A bundle holds what the library runs: input and message Linear multiplied out, the output scale folded into the head,
the queries of the pooling as numbers. The weights are found again by writing the graphs of a model of the same
architecture whose weights are random: a constant of the bundle belongs to the weight that stands in its place there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper

from upt_training.bundle_folder import read_manifest
from upt_training.config import settings_from_dict
from upt_training.dataset import map_safetensors
from upt_training.errors import InputError
from upt_training.layers import EPS
from upt_training.model import Upt
from upt_training.onnx_graph import decoder_graph, embed_graph, latent_graph

# Weights that a bundle has multiplied with others.
MADE = {"embed.weight", "pool.q.weight", "pool.q.bias", "pool.norm_q.weight", "pool.norm_q.bias"}
GRAPHS = {"embed": embed_graph, "latent": latent_graph, "decoder": decoder_graph}


def bundle_state(folder: Path, like: Upt) -> dict[str, torch.Tensor]:
    """The state of a model of `like`'s architecture that computes what the bundle does.

    Normalisation of the inputs and coordinates are the bundle's. What a bundle does not tell apart (output scale, width
    of the differences) is `like`'s, and the other weights are chosen to match.
    """
    folder = Path(folder)
    manifest = read_manifest(folder)
    if manifest["kind"] != "upt":
        raise InputError(f"{folder}: kind is {manifest['kind']!r}; only `upt` bundles hold weights to start from")
    _check_architecture(folder, manifest, like)
    with torch.random.fork_rng(devices=[]), torch.no_grad():  # the run's own draws stay as they are
        torch.manual_seed(0)
        model = Upt(like.settings)
        for parameter in model.parameters():
            parameter.normal_()
    found, constants = _constants(folder, model)
    state = model.state_dict()
    missing = {name for name, _ in model.named_parameters()} - set(found) - MADE
    if missing:
        raise InputError(f"{folder}: {sorted(missing)[0]} is in none of its graphs; export the bundle again")
    for name, values in found.items():
        state[name] = torch.from_numpy(values)
    entry = manifest["upt"]
    state["feature_mean"] = torch.tensor(entry["normalisation"]["mean"])
    state["feature_std"] = torch.tensor(entry["normalisation"]["std"])
    state["coordinate_offset"] = torch.tensor(entry["coordinates"]["offset"])
    state["coordinate_scale"] = torch.tensor(entry["coordinates"]["scale"])
    state["output_scale"] = like.output_scale.detach().cpu().clone()
    state["mixing"] = like.mixing.detach().cpu().clone()
    state["embed.weight"] = _input_weight(folder / entry["weights"], state)
    state["decoder.head.weight"] /= state["output_scale"][:, None]
    state["decoder.head.bias"] /= state["output_scale"]
    _pooling_queries(state, next(c for c in constants if c.shape == tuple(state["pool.tokens"].shape)))
    return state


def _check_architecture(folder: Path, manifest: dict, like: Upt) -> None:
    trained = manifest["provenance"].get("architecture")
    if trained is None:
        raise InputError(f"{folder}: bundle.json has no provenance.architecture; start from a checkpoint (last.pt)")
    theirs = settings_from_dict({"name": manifest["name"], "model": trained}, str(folder)).model
    for name, own in asdict(like.settings).items():
        found = getattr(theirs, name)
        if name not in ("graph", "drop_path") and found != own:
            raise InputError(f"{folder}: its model has {name} = {found!r}, the configuration asks for {own!r}")
    if theirs.relative_positions:
        raise InputError(f"{folder}: weights with relative positions cannot be read from a bundle; use its checkpoint")


def _constants(folder: Path, model: Upt) -> tuple[dict[str, np.ndarray], list[np.ndarray]]:
    """Each weight that a graph holds, and the constants of the graphs that are none."""
    found, others = {}, []
    for graph, write in GRAPHS.items():
        path = folder / f"{graph}.onnx"
        theirs = list(_floats(onnx.load(path)))
        places = list(_floats(write(model)))
        if [a.shape for a in theirs] != [a.shape for a in places]:
            raise InputError(f"{path}: its constants are not those of its architecture; export the bundle again")
        for values, place in zip(theirs, places, strict=True):
            weight = _weight_of(model, place)
            if weight is None:
                others.append(values)
                continue
            name, part, turned = weight
            if name not in found:
                found[name] = model.state_dict()[name].numpy().copy()
            found[name][part] = values.T if turned else values
    return found, others


def _floats(graph: onnx.ModelProto) -> Iterator[np.ndarray]:
    for tensor in graph.graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.dtype.kind == "f" and values.size > 2:
            yield values.astype(np.float32)


def _weight_of(model: Upt, place: np.ndarray) -> tuple[str, tuple, bool] | None:
    """The weight whose random numbers these are, the part of it, and whether it is transposed."""
    for name, weight in model.state_dict().items():
        own = weight.numpy()
        if own.shape == place.shape and np.array_equal(own, place):
            return name, (slice(None),), False
        if own.ndim != 2 or place.ndim != 2 or own.shape[0] != place.shape[1]:
            continue
        width = place.shape[0]
        for first in range(0, own.shape[1], width):
            if np.array_equal(own[:, first : first + width].T, place):
                return name, (slice(None), slice(first, first + width)), True
    return None


def _input_weight(path: Path, state: dict[str, torch.Tensor]) -> torch.Tensor:
    """`embed.weight` from `encoder.source` and `encoder.target`: message Linear times it times the mixing."""
    tensors = map_safetensors(path)[0]
    width = len(state["embed.bias"])
    message = state["message1.weight"].double().numpy()
    message = np.concatenate([message[:, :width], message[:, width:]])
    products = np.concatenate([tensors["encoder.source"], tensors["encoder.target"]]).astype(np.float64)
    mixed = np.linalg.lstsq(message, products, rcond=None)[0]
    return torch.from_numpy(mixed @ np.linalg.inv(state["mixing"].double().numpy())).float()


def _pooling_queries(state: dict[str, torch.Tensor], queries: np.ndarray) -> None:
    """A query Linear of the pooling that makes these queries of its tokens."""
    with torch.no_grad():
        state["pool.norm_q.weight"].fill_(1.0)
        state["pool.norm_q.bias"].zero_()
        tokens = state["pool.tokens"].double()
        inputs = torch.nn.functional.layer_norm(tokens, tokens.shape[-1:], eps=EPS).numpy()
    wide = np.concatenate([inputs, np.ones((len(inputs), 1))], axis=1)
    weight = np.linalg.lstsq(wide, queries.astype(np.float64), rcond=None)[0]
    state["pool.q.weight"] = torch.from_numpy(weight[:-1].T).float()
    state["pool.q.bias"] = torch.from_numpy(weight[-1]).float()
