"""The mean of several trainings of one bundle: `latent.onnx` computes each correction and averages them.

The errors of trainings on other cases are partly independent, so a part of them cancels. The trainings share modes and
tables (`build --keep`). The bound of the runtime is the widest of theirs, the envelope spans all of them.
"""

from __future__ import annotations

from pathlib import Path

import onnx
from onnx import compose, helper

from upt_training.bundle_folder import MANIFEST, copy_whole, new_bundle, read_manifest, write_manifest
from upt_training.errors import InputError


def mean_graph(paths: list[Path]) -> onnx.ModelProto:
    """`state -> b_next`, the mean of what the graphs give."""
    models = [
        compose.add_prefix(onnx.load(str(path)), f"training{index}_", rename_inputs=False)
        for index, path in enumerate(paths)
    ]
    outputs = [model.graph.output[0] for model in models]
    mean = helper.make_node("Mean", [output.name for output in outputs], ["b_next"])
    after = onnx.ValueInfoProto()
    after.CopyFrom(outputs[0])
    after.name = "b_next"
    graph = helper.make_graph(
        [*(node for model in models for node in model.graph.node), mean],
        "latent",
        list(models[0].graph.input),
        [after],
        [tensor for model in models for tensor in model.graph.initializer],
    )
    proto = helper.make_model(graph, opset_imports=list(models[0].opset_import), producer_name="upt_training")
    proto.ir_version = models[0].ir_version
    onnx.checker.check_model(proto, full_check=True)
    return proto


def average(bundles: list[Path], out: Path) -> dict:
    """Write the folder `out`, a copy of the first bundle with the mean correction, and return its manifest."""
    manifests = [read_manifest(bundle) for bundle in bundles]
    for bundle, manifest in zip(bundles, manifests, strict=True):
        if manifest.get("kind") != "reduced" or "reduced" not in manifest:
            raise InputError(f"{bundle / MANIFEST}: has no learned correction; average bundles of `build`")
        same = ("prior.safetensors", "mesh.safetensors")
        if any(manifest["files"][name] != manifests[0]["files"][name] for name in same):
            raise InputError(f"{bundle / MANIFEST}: has other tables than {bundles[0]}; train it by `build --keep`")
    manifest = manifests[0]
    envelopes = [other["envelope"] for other in manifests]
    areas = [envelope["contact_area_mm2"] for envelope in envelopes]
    widest = ("max_push_mm", "max_push_rate_mm", "max_sites", "displacement_bound_mm")
    manifest["envelope"] |= {name: max(envelope[name] for envelope in envelopes) for name in widest}
    manifest["envelope"]["contact_area_mm2"] = [min(a for a, _ in areas), max(b for _, b in areas)]
    limits = [other["reduced"] for other in manifests]
    bound = {name: max(limit["bound"][name] for limit in limits) for name in ("relative", "decay")}
    fade = {name: min(limit["fade"][name] for limit in limits) for name in ("start_push_mm", "end_push_mm")}
    manifest["reduced"] |= {"bound": bound, "fade": fade}
    manifest["provenance"] = {"mean_of": [other["provenance"] for other in manifests]}
    manifest["errors"] = {}
    with new_bundle(out) as folder:
        copy_whole(bundles[0], manifest, folder)
        onnx.save(mean_graph([bundle / "latent.onnx" for bundle in bundles]), str(folder / "latent.onnx"))
        write_manifest(folder, manifest)
    return manifest
