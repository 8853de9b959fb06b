"""`latent.onnx` of a reduced bundle: `state [1, n_in] -> b_next [1, r]`, the base and the MLP of `network.py`.

The MLP's input scale is folded into its first layer and its output scale into the last; inputs with scale 0 cost
nothing but their zeros. GELU is exact.
"""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from upt_training.reduced.network import Correction

OPSET = 20


def weights_of(model: Correction) -> dict[str, np.ndarray]:
    """The graph's matrices, `[in, out]` float32."""
    state = {name: tensor.detach().numpy() for name, tensor in model.state_dict().items()}
    layers = [layer for layer in model.mlp if hasattr(layer, "weight")]
    out = {name: state[name] for name in ("quadratic", "contact_base", "free_base")}
    for index, layer in enumerate(layers):
        weight = layer.weight.detach().double().numpy().T
        bias = layer.bias.detach().double().numpy()
        if index == 0:
            weight = weight * state["input_scale"].astype(np.float64)[:, None]
        if index == len(layers) - 1:
            weight, bias = weight * state["output_scale"], bias * state["output_scale"]
        out[f"layer{index}"], out[f"layer{index}_bias"] = weight, bias
    return {name: np.ascontiguousarray(tensor, np.float32) for name, tensor in out.items()}


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
    parts = ["b", "b_prev", "z", "z_prev", "p", "p_prev", "contact", "contact_prev"]
    nodes = [node("Split", ["state", "sizes"], parts, axis=1)]
    for z, static in (("z", "static"), ("z_prev", "static_prev")):
        nodes += [
            node("Gather", [z, "first"], [f"{z}_first"], axis=1),
            node("Gather", [z, "second"], [f"{z}_second"], axis=1),
            node("Mul", [f"{z}_first", f"{z}_second"], [f"{z}_square"]),
            node("MatMul", [f"{z}_square", "quadratic"], [static]),
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
    layers = sum(name.startswith("layer") and not name.endswith("_bias") for name in constants)
    last = "state"
    for index in range(layers):
        nodes.append(node("MatMul", [last, f"layer{index}"], [f"product{index}"]))
        nodes.append(node("Add", [f"product{index}", f"layer{index}_bias"], [f"sum{index}"]))
        last = f"sum{index}"
        if index < layers - 1:
            nodes.append(node("Gelu", [last], [f"hidden{index}"]))
            last = f"hidden{index}"
    nodes.append(node("Add", ["base", last], ["b_next"]))
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
