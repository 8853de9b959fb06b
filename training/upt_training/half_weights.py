"""Weights that are stored in half precision and computed with in float32: half the file, the same arithmetic.

Large weights are rounded once, in the model; a graph then holds them as float16 and casts them when it is loaded.
"""

from __future__ import annotations

import numpy as np
import onnx
import torch
from onnx import TensorProto, numpy_helper

#: Smaller tensors stay as they are: biases, normalisations.
SMALLEST = 64


def round_weights(model: torch.nn.Module) -> torch.nn.Module:
    """The model with its large weights rounded to half precision, in float32."""
    with torch.no_grad():
        for parameter in model.parameters():
            if parameter.numel() >= SMALLEST:
                parameter.copy_(parameter.half().to(parameter.dtype))
    return model


def store_in_half(graph: onnx.ModelProto) -> None:
    """Stores each large float32 constant that float16 holds exactly as that, behind a cast."""
    casts = []
    for tensor in graph.graph.initializer:
        if tensor.data_type != TensorProto.FLOAT:
            continue
        values = numpy_helper.to_array(tensor)
        with np.errstate(over="ignore"):
            half = values.astype(np.float16)
        if values.size < SMALLEST or not np.array_equal(half.astype(np.float32), values):
            continue
        name = tensor.name
        tensor.CopyFrom(numpy_helper.from_array(half, name + ".half"))
        casts.append(onnx.helper.make_node("Cast", [name + ".half"], [name], to=TensorProto.FLOAT))
    nodes = [*casts, *graph.graph.node]
    del graph.graph.node[:]
    graph.graph.node.extend(nodes)
