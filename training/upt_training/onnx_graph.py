"""The bundle's ONNX graphs, written node by node (opset 17, float32, MatMul + Add so that the quantiser can read them).

Give a float64 copy of the model: what is multiplied out here is then rounded once. `embed.onnx`, which runs once a mesh
and always on the CPU, has the angles of the sincos embedding in float64 and is float32 behind them: an angle of 200 in
float32 is off by 1e-5, which would be the largest error of the whole network.

Only plain operators are used (no scatter, no control flow, no shape arithmetic beyond the dynamic node count), so that
the CPU, CUDA, TensorRT and TensorRT-RTX providers all take them. GELU is the exact one, `0.5 x (1 + erf(x / sqrt 2))`.
"""

from __future__ import annotations

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

from upt_training.layers import EPS, sincos_frequencies
from upt_training.model import RELATIVE_SCALE, Upt

OPSET = 17
CACHE_BYTES = 16e6  # of a CPU's last level, roughly


class Writer:
    """Collects nodes and initialisers; values are names."""

    def __init__(self, name: str):
        self.name, self.nodes, self.constants = name, [], {}
        self.inputs, self.outputs, self.count = [], [], 0

    def constant(self, value, hint: str = "w", double: bool = False) -> str:
        array = value.detach().cpu().numpy() if isinstance(value, torch.Tensor) else np.asarray(value)
        if array.dtype.kind == "f":
            array = array.astype(np.float64 if double else np.float32)
        name = f"{hint}_{len(self.constants)}"
        self.constants[name] = numpy_helper.from_array(np.ascontiguousarray(array), name)
        return name

    def op(self, kind: str, *inputs: str, outputs: int = 1, **attributes):
        names = [
            f"{kind.lower()}_{self.count}_{i}" if outputs > 1 else f"{kind.lower()}_{self.count}"
            for i in range(outputs)
        ]
        self.nodes.append(helper.make_node(kind, list(inputs), names, name=f"{kind}_{self.count}", **attributes))
        self.count += 1
        return names if outputs > 1 else names[0]

    def input(self, name: str, shape: list, kind=TensorProto.FLOAT) -> str:
        self.inputs.append(helper.make_tensor_value_info(name, kind, shape))
        return name

    def output(self, value: str, name: str, shape: list) -> None:
        self.nodes.append(helper.make_node("Identity", [value], [name], name=f"out_{name}"))
        self.outputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, shape))

    def build(self) -> onnx.ModelProto:
        graph = helper.make_graph(self.nodes, self.name, self.inputs, self.outputs, list(self.constants.values()))
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
        model.producer_name = "upt_training"
        onnx.checker.check_model(model)
        return model

    # -- layers -------------------------------------------------------------------------------------------------

    def linear(self, x: str, weight, bias=None) -> str:
        y = self.op("MatMul", x, self.constant(weight.T))
        return y if bias is None else self.op("Add", y, self.constant(bias, "b"))

    def layer(self, x: str, module) -> str:
        return self.linear(x, module.weight, module.bias)

    def norm(self, x: str, module) -> str:
        return self.op(
            "LayerNormalization",
            x,
            self.constant(module.weight),
            self.constant(module.bias, "b"),
            axis=-1,
            epsilon=EPS,
        )

    def gelu(self, x: str) -> str:
        erf = self.op("Erf", self.op("Div", x, self.constant(np.float32(np.sqrt(2.0)))))
        return self.op(
            "Mul",
            self.op("Mul", x, self.op("Add", erf, self.constant(np.float32(1.0)))),
            self.constant(np.float32(0.5)),
        )

    def mlp(self, x: str, module) -> str:
        return self.layer(self.gelu(self.layer(x, module.fc1)), module.fc2)

    def attention(self, q: str, k: str, v: str, heads: int, width: int, apart: bool = False) -> str:
        """`q [n, w]`, `k, v [L, w]` -> `[n, w]`; the scale is applied to the (static or small) queries.

        `apart`: one head after another, so that only one head's weights `[n, L]` are in memory.
        """
        q = self.op("Mul", q, self.constant(np.float32((width // heads) ** -0.5)))
        if apart and heads > 1:
            one = zip(self.split(q, heads), self.split(k, heads), self.split(v, heads), strict=True)
            return self.op("Concat", *[self._head(*head) for head in one], axis=-1)
        shape = self.constant(np.asarray([-1, heads, width // heads], np.int64))
        merged = self.constant(np.asarray([-1, width], np.int64))
        qh = self.op("Transpose", self.op("Reshape", q, shape), perm=[1, 0, 2])
        kh = self.op("Transpose", self.op("Reshape", k, shape), perm=[1, 2, 0])
        vh = self.op("Transpose", self.op("Reshape", v, shape), perm=[1, 0, 2])
        weight = self.op("Softmax", self.op("MatMul", qh, kh), axis=-1)
        return self.op("Reshape", self.op("Transpose", self.op("MatMul", weight, vh), perm=[1, 0, 2]), merged)

    def _head(self, q: str, k: str, v: str) -> str:
        score = self.op("MatMul", q, self.op("Transpose", k, perm=[1, 0]))
        return self.op("MatMul", self.op("Softmax", score, axis=-1), v)

    def split(self, x: str, parts: int) -> list[str]:
        return self.op("Split", x, outputs=parts, axis=-1)

    def block(self, x: str, module, width: int, apart: bool = False) -> str:
        q, k, v = self.split(self.layer(self.norm(x, module.norm1), module.qkv), 3)
        x = self.op("Add", x, self.layer(self.attention(q, k, v, module.heads, width, apart), module.proj))
        return self.op("Add", x, self.mlp(self.norm(x, module.norm2), module.mlp))

    def pool(self, context: str, module, width: int) -> str:
        tokens = self.constant(module.tokens)
        k, v = self.split(self.layer(self.norm(context, module.norm_kv), module.kv), 2)
        q = self.constant(module.q(module.norm_q(module.tokens)))
        x = self.op("Add", tokens, self.layer(self.attention(q, k, v, module.heads, width), module.proj))
        return self.op("Add", x, self.mlp(self.norm(x, module.norm2), module.mlp))

    def sincos(self, coordinates: str, width: int, double: bool = False) -> str:
        """`[n, 3]` -> `[n, width]` float32; `double`: the coordinates are float64, and so are the angles' turns."""
        frequency = sincos_frequencies(width).reshape(1, 1, -1)
        angle = self.op("Mul", self.op("Unsqueeze", coordinates, self.constant(np.asarray([-1], np.int64))),
                        self.constant(frequency, double=double))  # fmt: skip
        if double:
            angle = self.cast(self._without_turns(angle), TensorProto.FLOAT)
        wave = self.op("Concat", self.op("Sin", angle), self.op("Cos", angle), axis=-1)
        used = frequency.size * 6
        flat = self.op("Reshape", wave, self.constant(np.asarray([-1, used], np.int64)))
        if used == width:
            return flat
        return self.op("Pad", flat, self.constant(np.asarray([0, 0, 0, width - used], np.int64)))

    def _without_turns(self, angle: str) -> str:
        """The same angle (float64) within half a turn of 0."""
        turn = self.constant(np.float64(2.0 * np.pi), double=True)
        return self.op("Sub", angle, self.op("Mul", self.op("Round", self.op("Div", angle, turn)), turn))

    def cast(self, x: str, kind: int) -> str:
        return self.op("Cast", x, to=kind)


# -- pieces shared by the graphs ----------------------------------------------------------------------------------


def _coordinates(w: Writer, model: Upt, positions: str, double: bool = False) -> str:
    """Model coordinates of positions, both in the precision asked for."""
    shifted = w.op("Sub", positions, w.constant(model.coordinate_offset.reshape(1, 3), double=double))
    return w.op("Mul", shifted, w.constant(model.coordinate_scale, double=double))


def _latent(w: Writer, model: Upt, aggregated: str, message2: bool = True, apart: bool = False) -> tuple[str, str]:
    s = model.settings
    x = w.layer(aggregated, model.message2) if message2 else aggregated
    for block in model.encoder:
        x = w.block(x, block, s.encoder, apart)
    z = w.pool(x, model.pool, s.latent)
    for block in model.approximator:
        z = w.block(z, block, s.latent)
    k, v = w.split(w.layer(w.norm(z, model.decoder.norm_kv), model.decoder.kv), 2)
    return k, v


def _query_table(w: Writer, model: Upt, coordinates: str, double: bool = False) -> str:
    d = model.decoder
    embedding = w.sincos(coordinates, model.settings.decoder, double)
    x = w.layer(w.gelu(w.layer(embedding, d.query1)), d.query2)
    return w.op("Concat", x, w.layer(w.norm(x, d.norm1), d.q), axis=-1)


def _decode(w: Writer, model: Upt, query: str, k: str, v: str) -> str:
    d, s = model.decoder, model.settings
    x, q = w.split(query, 2)
    y = w.op("Add", x, w.layer(w.attention(q, k, v, d.heads, s.decoder), d.proj))
    y = w.op("Add", y, w.mlp(w.norm(y, d.norm2), d.mlp))
    weight, bias = scaled_head(model)
    return w.linear(w.norm(y, d.norm3), weight, bias)


def scaled_head(model: Upt) -> tuple[torch.Tensor, torch.Tensor]:
    """The last Linear with the output scale (mm) folded in."""
    scale = model.output_scale
    return model.decoder.head.weight * scale[:, None], model.decoder.head.bias * scale


# -- the graphs of docs/reference/formats.md --------------------------------------------------------------------------


def embed_graph(model: Upt) -> onnx.ModelProto:
    s, w = model.settings, Writer("embed")
    p = _coordinates(w, model, w.cast(w.input("positions", ["n", 3]), TensorProto.DOUBLE), double=True)
    d = s.encoder
    x = w.op("Add", w.sincos(p, d, double=True), w.constant(model.embed.bias))
    source = w.linear(x, model.message1.weight[:, :d])
    target = w.linear(x, model.message1.weight[:, d:], model.message1.bias)
    if model.relative is not None:
        place = w.linear(w.cast(p, TensorProto.FLOAT), RELATIVE_SCALE * model.relative.weight)
        source, target = w.op("Add", source, place), w.op("Sub", target, place)
    w.output(source, "source_table", ["n", d])
    w.output(target, "target_table", ["n", d])
    w.output(_query_table(w, model, p, double=True), "query_table", ["n", 2 * s.decoder])
    return w.build()


def encoder_graph(model: Upt) -> onnx.ModelProto:
    s, w = model.settings, Writer("encoder")
    d = s.encoder
    features = w.input("features", ["n", s.feature_count])
    source_table, target_table = (
        w.input("source_table", ["n", d]),
        w.input("target_table", ["n", d]),
    )
    w_source, w_target = model.encoder_weights()
    w.output(w.op("Add", w.linear(features, w_source), source_table), "source", ["n", d])
    w.output(w.op("Add", w.linear(features, w_target), target_table), "target", ["n", d])
    return w.build()


def latent_graph(model: Upt) -> onnx.ModelProto:
    """The network between mean and decoder. Where the encoder's attention is larger than a cache, its heads are apart:
    less memory, and on the CPU faster."""
    s, w = model.settings, Writer("latent")
    weights = 4 * s.encoder_heads * s.graph.supernodes**2
    k, v = _latent(w, model, w.input("supernodes", ["n_S", s.encoder]), apart=weights > CACHE_BYTES)
    w.output(k, "keys", [s.latent_tokens, s.decoder])
    w.output(v, "values", [s.latent_tokens, s.decoder])
    return w.build()


def decoder_graph(model: Upt) -> onnx.ModelProto:
    s, w = model.settings, Writer("decoder")
    query = w.input("queries", ["n", 2 * s.decoder])
    k = w.input("keys", [s.latent_tokens, s.decoder])
    v = w.input("values", [s.latent_tokens, s.decoder])
    w.output(_decode(w, model, query, k, v), "displacement", ["n", 3])
    return w.build()


def step_graph(model: Upt) -> onnx.ModelProto:
    """The whole step in one graph: padded gather and masked mean in place of the native aggregation.

    The `e` rows of features and of the two encoder tables are the supernodes and their neighbours (or all nodes); the
    `n` rows of the query table are the nodes to decode. Keys and values leave the graph too, so that a host can decode
    more later.
    """
    s, w = model.settings, Writer("step")
    d, degree = s.encoder, s.graph.max_degree
    features = w.input("features", ["e", s.feature_count])
    source_table, target_table = (
        w.input("source_table", ["e", d]),
        w.input("target_table", ["e", d]),
    )
    query = w.input("query_table", ["n", 2 * s.decoder])
    neighbours = w.input("neighbours", ["n_S", degree], TensorProto.INT64)
    mask = w.input("mask", ["n_S", degree])
    supernodes = w.input("supernodes", ["n_S"], TensorProto.INT64)
    w_source, w_target = model.encoder_weights()
    source = w.op("Add", w.linear(features, w_source), source_table)
    at = w.op("Gather", features, supernodes, axis=0)
    target = w.op("Add", w.linear(at, w_target), w.op("Gather", target_table, supernodes, axis=0))
    last, middle = w.constant(np.asarray([-1], np.int64)), w.constant(np.asarray([1], np.int64))
    edge = w.gelu(w.op("Add", w.op("Gather", source, neighbours, axis=0), w.op("Unsqueeze", target, middle)))
    total = w.op("ReduceSum", w.op("Mul", edge, w.op("Unsqueeze", mask, last)), middle, keepdims=0)
    mean = w.op("Div", total, w.op("ReduceSum", mask, middle, keepdims=1))
    k, v = _latent(w, model, mean)
    w.output(_decode(w, model, query, k, v), "displacement", ["n", 3])
    w.output(k, "keys", [s.latent_tokens, s.decoder])
    w.output(v, "values", [s.latent_tokens, s.decoder])
    return w.build()


def paper_encoder_graph(model: Upt) -> onnx.ModelProto:
    """The paper's first half: one message an edge (`edge_source`, `edge_target` are node indices)."""
    s, w = model.settings, Writer("paper_encoder")
    features = w.input("features", ["n", s.feature_count])
    p = _coordinates(w, model, w.input("positions", ["n", 3]))
    sender = w.input("edge_source", ["edges"], TensorProto.INT64)
    receiver = w.input("edge_target", ["edges"], TensorProto.INT64)
    x = w.linear(features, model.embed.weight @ model.mixing, model.embed.bias)
    x = w.op("Add", x, w.sincos(p, s.encoder))
    pair = w.op("Concat", w.op("Gather", x, sender, axis=0), w.op("Gather", x, receiver, axis=0), axis=-1)
    edge = w.layer(pair, model.message1)
    if model.relative is not None:
        apart = w.op("Sub", w.op("Gather", p, sender, axis=0), w.op("Gather", p, receiver, axis=0))
        edge = w.op("Add", edge, w.linear(apart, RELATIVE_SCALE * model.relative.weight))
    message = w.layer(w.gelu(edge), model.message2)
    w.output(message, "messages", ["edges", s.encoder])
    return w.build()


def paper_decoder_graph(model: Upt) -> onnx.ModelProto:
    """The paper's second half: mean messages of the supernodes and all positions -> displacement."""
    s, w = model.settings, Writer("paper_decoder")
    aggregated = w.input("supernodes", ["n_S", s.encoder])
    p = _coordinates(w, model, w.input("positions", ["n", 3]))
    k, v = _latent(w, model, aggregated, message2=False)
    w.output(_decode(w, model, _query_table(w, model, p), k, v), "displacement", ["n", 3])
    return w.build()
