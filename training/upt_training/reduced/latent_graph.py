"""`latent.onnx` of a reduced bundle: `state [1, n_in] -> b_next [1, r]`, the base and the MLP of `network.py`.

The MLP's input scale is folded into its first layer and its output scale into the last; inputs with scale 0 cost
nothing but their zeros. GELU is exact.
"""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper
from torch import nn

from upt_training.reduced.network import Correction

OPSET = 20


def weights_of(model: Correction) -> dict[str, np.ndarray]:
    """The graph's matrices, `[in, out]` float32."""
    state = {name: tensor.detach().numpy() for name, tensor in model.state_dict().items()}
    out = {name: state[name] for name in ("quadratic", "contact_base", "free_base")}
    out |= layers_of(model.mlp, "layer", state["input_scale"], state["output_scale"])
    if model.static_mlp is not None:
        scales = np.broadcast_to(state["static_input_scale"], model.response_modes), state["static_output_scale"]
        out |= layers_of(model.static_mlp, "static_layer", *scales)
        out["static_square"] = state["static_square"]
    return {name: np.ascontiguousarray(tensor, np.float32) for name, tensor in out.items()}


def layers_of(network: nn.Sequential, prefix: str, input_scale: np.ndarray, output_scale: np.ndarray) -> dict:
    """Weights and biases of an MLP with the scale of its inputs and outputs folded in."""
    layers = [layer for layer in network if hasattr(layer, "weight")]
    out = {}
    for index, layer in enumerate(layers):
        weight = layer.weight.detach().double().numpy().T
        bias = layer.bias.detach().double().numpy()
        if index == 0:
            weight = weight * input_scale.astype(np.float64)[:, None]
        if index == len(layers) - 1:
            weight, bias = weight * output_scale, bias * output_scale
        out[f"{prefix}{index}"], out[f"{prefix}{index}_bias"] = weight, bias
    return out


def mlp_nodes(constants: dict, prefix: str, start: str, end: str) -> list[onnx.NodeProto]:
    """Nodes of an MLP from `start` to `end`, whose intermediate names begin with `end`."""
    node = helper.make_node
    layers = sum(name.startswith(prefix) and not name.endswith("_bias") for name in constants)
    nodes, last = [], start
    for index in range(layers):
        out = end if index == layers - 1 else f"{end}_sum{index}"
        nodes.append(node("MatMul", [last, f"{prefix}{index}"], [f"{end}_product{index}"]))
        nodes.append(node("Add", [f"{end}_product{index}", f"{prefix}{index}_bias"], [out]))
        last = out
        if index < layers - 1:
            nodes.append(node("Gelu", [last], [f"{end}_hidden{index}"]))
            last = f"{end}_hidden{index}"
    return nodes


def latent_graph(model: Correction) -> onnx.ModelProto:
    """The correction as an ONNX graph."""
    node = helper.make_node
    constants = {
        **weights_of(model),
        "sizes": np.array(model.sizes, np.int64),
        "first": model.first.numpy().astype(np.int64),
        "second": model.second.numpy().astype(np.int64),
        "one": np.array(1.0, np.float32),
    }
    if model.static_mlp is not None:
        constants["axis"] = np.array([1], np.int64)
    parts = ["b", "b_prev", "z", "z_prev", "p", "p_prev", "contact", "contact_prev"]
    nodes = [node("Split", ["state", "sizes"], parts, axis=1)]
    for z, static in (("z", "static"), ("z_prev", "static_prev")):
        nodes += [
            node("Gather", [z, "first"], [f"{z}_first"], axis=1),
            node("Gather", [z, "second"], [f"{z}_second"], axis=1),
            node("Mul", [f"{z}_first", f"{z}_second"], [f"{z}_square"]),
            node("MatMul", [f"{z}_square", "quadratic"], [static if model.static_mlp is None else f"{z}_quadratic"]),
        ]
        if model.static_mlp is not None:
            nodes += mlp_nodes(constants, "static_layer", z, f"{z}_network")
            nodes += [
                node("ReduceSumSquare", [z, "axis"], [f"{z}_size"], keepdims=1),
                node("Add", [f"{z}_size", "static_square"], [f"{z}_size_more"]),
                node("Div", [f"{z}_size", f"{z}_size_more"], [f"{z}_share"]),
                node("Mul", [f"{z}_network", f"{z}_share"], [f"{z}_beyond"]),
                node("Add", [f"{z}_quadratic", f"{z}_beyond"], [static]),
            ]
    nodes += [
        node("Sub", ["b", "static_prev"], ["lag"]),
        node("Sub", ["b", "b_prev"], ["drift"]),
        node("Sub", ["z", "z_prev"], ["velocity"]),
        node("Concat", ["lag", "drift", "velocity"], ["contact_inputs"], axis=1),
        node("MatMul", ["contact_inputs", "contact_base"], ["dynamic"]),
        node("Add", ["static", "dynamic"], ["touching"]),
        node("Add", ["b", "p_prev"], ["whole"]),
        node("Concat", ["whole", "b_prev", "p_prev"], ["free_inputs"], axis=1),
        node("MatMul", ["free_inputs", "free_base"], ["free"]),
        node("Sub", ["one", "contact"], ["no_contact"]),
        node("Mul", ["touching", "contact"], ["touching_part"]),
        node("Mul", ["free", "no_contact"], ["free_part"]),
        node("Add", ["touching_part", "free_part"], ["base"]),
    ]
    nodes += mlp_nodes(constants, "layer", "state", "learned")
    nodes.append(node("Add", ["base", "learned"], ["b_next"]))
    graph = helper.make_graph(
        nodes,
        "latent",
        [helper.make_tensor_value_info("state", TensorProto.FLOAT, ["n", model.inputs])],
        [helper.make_tensor_value_info("b_next", TensorProto.FLOAT, ["n", model.modes])],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    proto = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="upt_training")
    proto.ir_version = 9
    onnx.checker.check_model(proto, full_check=True)
    return proto
