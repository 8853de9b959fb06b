"""`python -m upt_training export RUN --out BUNDLE`: the run's best weights as a checked bundle."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from upt_training.bundle import MATERIAL, write_bundle
from upt_training.bundle_folder import read_manifest
from upt_training.config import settings_from_dict
from upt_training.dataset import Dataset, open_dataset, open_trajectory
from upt_training.envelope import measure_envelope
from upt_training.kept import keep_parts
from upt_training.loads import TRAINED
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.model import Upt, load_state
from upt_training.prior_table import PriorTable
from upt_training.rest import write_rest
from upt_training.run import open_prior
from upt_training.trainer import load_checkpoint


def load_model(run: Path) -> tuple[Upt, dict]:
    """The best (else last) weights of a run, averaged ones where there are any, and the checkpoint."""
    run = Path(run)
    path = run
    if run.is_dir():
        path = run / "best.pt" if (run / "best.pt").exists() else run / "last.pt"
    checkpoint = load_checkpoint(path)
    settings = settings_from_dict(checkpoint["settings"], str(path))
    model = Upt(settings.model)
    load_state(model, checkpoint["ema"] or checkpoint["model"], str(path))
    return model.eval(), checkpoint


def real_features(
    model: Upt, mesh: Mesh, dataset: Dataset, prior: PriorTable | None, count: int = 3
) -> list[np.ndarray]:
    """Normalised features of true states, for the self-check."""
    import torch

    table = None if prior is None else prior.restrict(None)
    out = []
    for case in dataset.select("test")[:count]:
        trajectory = open_trajectory(case.path, mesh)
        t = trajectory.frame_count // 2
        nodes, vectors = trajectory.contact(t)
        collision, contact = (
            np.zeros((mesh.node_count, 3), np.float32),
            np.zeros((mesh.node_count, 1), np.float32),
        )
        collision[nodes], contact[nodes] = vectors, 1.0
        fields = {
            "displacement": np.asarray(trajectory.displacement[t - 1], np.float32),
            "previous_displacement": np.asarray(trajectory.displacement[t - 2], np.float32),
            "collision": collision,
            "contact": contact,
        }
        if table is not None:
            sequence = table.sequence()
            fields["previous_prior"] = sequence.step(*trajectory.contact(t - 1))
            fields["prior"] = sequence.step(nodes, vectors)
        fields = {k: torch.from_numpy(np.array(v)) for k, v in fields.items()}
        out.append(model.normalise(fields).numpy())
    return out


def bundle_errors(path: Path) -> dict:
    """The summary of an `evaluate` JSON for bundle.json."""
    result = json.loads(Path(path).read_text())
    out = {}
    for name, table in {
        **{f"scheme_{k}": v for k, v in result["schemes"].items()},
        "all": result["all"],
    }.items():
        out[name] = {k: round(v["mean"], 6) for k, v in table["bundle"].items()}
    inner = [c["bundle"] for c in result["cases"] if c["scheme"] in TRAINED]
    if inner:
        out["schemes_1_4"] = {k: round(float(np.mean([c[k] for c in inner])), 6) for k in inner[0]}
    return out


def export_command(options) -> int:
    mesh = load_mesh(options.mesh)
    model, checkpoint = load_model(options.run)
    settings = checkpoint["settings"]
    datasets = [open_dataset(folder, mesh) for folder in options.data or []]
    dataset = datasets[0] if datasets else None
    prior = open_prior(model.settings, mesh, options.prior, options.vibration)
    for name in ("radius_mm", "max_degree", "supernodes"):
        if getattr(options, name) is not None:
            setattr(model.settings.graph, name, getattr(options, name))
    provenance = {
        "configuration": settings["name"],
        "train": settings["train"],
        "architecture": settings["model"],
        "steps": checkpoint["step_count"],
        "trained_on_mesh_sha256": checkpoint["mesh_sha256"],
        "validation_mse_mm2": checkpoint["best"] if np.isfinite(checkpoint["best"]) else None,
        "date": datetime.now(UTC).date().isoformat(),
    }
    if dataset is not None:
        seeds = [d.manifest.get("seed") for d in datasets]
        provenance["data"] = {
            "seed": seeds[0] if len(seeds) == 1 else seeds,
            "cases": sum(len(d.cases) for d in datasets),
        }
    envelope = measure_envelope(mesh, [case for d in datasets for case in d.select("train")]) if datasets else None
    if options.envelope:
        other = json.loads((Path(options.envelope) / "bundle.json").read_text())
        measured, envelope = envelope, other["envelope"]
        # A patch's nodal area depends on the mesh that samples it.
        if measured and other["mesh"]["mesh_sha256"] != mesh.sha256:
            envelope = {**envelope, "contact_area_mm2": measured["contact_area_mm2"]}
    manifest = write_bundle(
        model,
        mesh,
        options.out,
        name=options.name or Path(options.out).name,
        description=options.description or (read_manifest(options.keep) if options.keep else settings)["description"],
        boundary=checkpoint.get("boundary", "fixed"),
        material=dataset.manifest.get("material", MATERIAL) if dataset else None,
        envelope=envelope,
        prior=options.prior,
        vibration=options.vibration,
        provenance=provenance,
        errors=bundle_errors(options.errors) if options.errors else None,
        paper_split=options.paper_split,
        step=options.step,
        precisions=("f32", *(["f16"] if options.f16 else []), *(["int8"] if options.int8 else [])),
        check_features=real_features(model, mesh, dataset, prior) if dataset else None,
        half_weights=options.half_weights,
    )
    if options.keep:
        keep_parts(options.keep, Path(options.out), mesh)
    write_rest(Path(options.out))
    check = {k: f"{v:.1e}" for k, v in manifest["provenance"]["export_check"].items()}
    size = sum(f["bytes"] for f in manifest["files"].values())
    print(f"{options.out}: {manifest['provenance']['parameters']} parameters, {size / 1e6:.1f} MB, self-check {check}")
    return 0
