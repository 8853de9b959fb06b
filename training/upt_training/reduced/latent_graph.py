"""`latent.onnx` of a reduced bundle: `state [1, n_in] -> b_next [1, r]`, the ridge bases and the MLP in three products.

The first product holds the MLP's first layer (input scale folded in) and both linear maps side by side; the last
layer has the output scale folded in. GELU is exact.
"""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from upt_training.reduced.network import Correction

OPSET = 20


def weights_of(model: Correction) -> dict[str, np.ndarray]:
    """The graph's matrices, `[in, out]` float32."""
    r, rz = model.modes, model.response_modes
    state = {name: tensor.detach().double().numpy() for name, tensor in model.state_dict().items()}
    layers = [m for m in model.mlp if hasattr(m, "weight")]
    matrices = [(layer.weight.detach().double().numpy().T, layer.bias.detach().double().numpy()) for layer in layers]
    contact = np.zeros((model.inputs, r))
    contact[:-2] = state["contact_base"]
    free = np.zeros((model.inputs, r))
    rows = np.r_[0 : 2 * r, 2 * r + rz : 2 * r + 2 * rz, 3 * r + 2 * rz : 4 * r + 2 * rz]
    free[rows] = state["free_base"]
    first, bias = matrices[0]
    first = first * state["input_scale"][:, None]
    last, last_bias = matrices[-1]
    out = {
        "first": np.concatenate([first, contact, free], axis=1),
        "first_bias": np.concatenate([bias, np.zeros(2 * r)]),
        "last": last * state["output_scale"],
        "last_bias": last_bias * state["output_scale"],
    }
    for index, (weight, offset) in enumerate(matrices[1:-1]):
        out[f"hidden{index}"], out[f"hidden{index}_bias"] = weight, offset
    return {name: tensor.astype(np.float32) for name, tensor in out.items()}


def latent_graph(model: Correction) -> onnx.ModelProto:
    """The correction as an ONNX graph."""
    weights = weights_of(model)
    hidden, r = model.mlp[0].out_features, model.modes
    constants = {
        **weights,
        "split_sizes": np.array([hidden, r, r], np.int64),
        "flag_start": np.array([model.inputs - 2], np.int64),
        "flag_end": np.array([model.inputs - 1], np.int64),
        "axis": np.array([1], np.int64),
        "one": np.array(1.0, np.float32),
    }
    nodes = [
        helper.make_node("MatMul", ["state", "first"], ["x0"]),
        helper.make_node("Add", ["x0", "first_bias"], ["x1"]),
        helper.make_node("Split", ["x1", "split_sizes"], ["h0", "touching", "free"], axis=1),
        helper.make_node("Gelu", ["h0"], ["a0"]),
        helper.make_node("Slice", ["state", "flag_start", "flag_end", "axis"], ["contact"]),
        helper.make_node("Sub", ["one", "contact"], ["no_contact"]),
        helper.make_node("Mul", ["touching", "contact"], ["touching_part"]),
        helper.make_node("Mul", ["free", "no_contact"], ["free_part"]),
        helper.make_node("Add", ["touching_part", "free_part"], ["base"]),
    ]
    last = "a0"
    for index in range(sum(name.startswith("hidden") and not name.endswith("_bias") for name in weights)):
        nodes += [
            helper.make_node("MatMul", [last, f"hidden{index}"], [f"m{index}"]),
            helper.make_node("Add", [f"m{index}", f"hidden{index}_bias"], [f"h{index + 1}"]),
            helper.make_node("Gelu", [f"h{index + 1}"], [f"a{index + 1}"]),
        ]
        last = f"a{index + 1}"
    nodes += [
        helper.make_node("MatMul", [last, "last"], ["y0"]),
        helper.make_node("Add", ["y0", "last_bias"], ["correction"]),
        helper.make_node("Add", ["base", "correction"], ["b_next"]),
    ]
    graph = helper.make_graph(
        nodes,
        "latent",
        [helper.make_tensor_value_info("state", TensorProto.FLOAT, ["n", model.inputs])],
        [helper.make_tensor_value_info("b_next", TensorProto.FLOAT, ["n", r])],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    proto = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="upt_training")
    proto.ir_version = 9
    onnx.checker.check_model(proto, full_check=True)
    return proto
