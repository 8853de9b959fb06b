"""Half-precision and int8 variants of a bundle's graphs (`*.f16.onnx`, `*.int8.onnx`); inputs and outputs stay float32.

int8 is dynamic quantisation of the MatMul weights (per channel); f16 converts the weights and the arithmetic. Which of
them is worth having is measured by `evaluate --precision`, over whole rollouts.
"""

from __future__ import annotations

from pathlib import Path

import onnx

GRAPHS = ("latent", "decoder", "step")


def write_variant(folder: Path, precision: str) -> None:
    """Write the variant of every graph in `GRAPHS` that the folder has beside its float32 file."""
    for name in GRAPHS:
        source, target = folder / f"{name}.onnx", folder / f"{name}.{precision}.onnx"
        if not source.exists():
            continue
        if precision == "int8":
            from onnxruntime.quantization import QuantType, quantize_dynamic

            quantize_dynamic(
                source,
                target,
                op_types_to_quantize=["MatMul"],
                per_channel=True,
                weight_type=QuantType.QInt8,
                extra_options={"MatMulConstBOnly": True},
            )
        elif precision == "f16":
            from onnxruntime.transformers.float16 import convert_float_to_float16

            onnx.save(convert_float_to_float16(onnx.load(str(source)), keep_io_types=True), str(target))
        else:
            raise ValueError(precision)
