"""`python -m upt_training train`: puts data, mesh, prior, configuration and device together and runs the trainer."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import torch
import torch.distributed as distributed

from upt_training.config import ModelSettings, Settings, load_settings
from upt_training.dataset import open_dataset
from upt_training.errors import InputError
from upt_training.field_cache import FieldCache, build_cache, join_caches
from upt_training.graph import build_graph
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.prior_table import PriorTable
from upt_training.trainer import Trainer

SUBSET_SEED = 11


def find_mesh(mesh: Path | None, data: Path) -> Mesh:
    """The mesh given, or the one in the data folder or in `onnx/meshes` whose hash the manifest names."""
    if mesh is not None:
        return load_mesh(mesh)
    import json

    manifest = Path(data) / "manifest.json"
    if not manifest.exists():
        raise InputError(f"{manifest}: no such file; make a dataset with `upt dataset`")
    wanted = json.loads(manifest.read_text()).get("mesh_sha256")
    for folder in (Path(data), Path("onnx/meshes"), Path("../onnx/meshes")):
        for path in sorted(folder.glob("*.mesh.safetensors")):
            found = load_mesh(path)
            if found.sha256 == wanted:
                return found
    raise InputError(f"{manifest}: its mesh was not found in {data} or onnx/meshes; pass --mesh")


def choose_device(name: str) -> str:
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    if name.startswith("cuda") and not torch.cuda.is_available():
        raise InputError(f"device {name!r} is missing on this machine; use --device cpu")
    return name


def training_nodes(mesh: Mesh, graph, loss_nodes: int) -> np.ndarray:
    """The encoder's needed nodes and `loss_nodes` further ones (seeded); 0: all nodes."""
    if loss_nodes == 0:
        return np.arange(mesh.node_count)
    needed = graph.needed_nodes()
    rest = np.setdiff1d(np.arange(mesh.node_count), needed)
    extra = np.random.default_rng(SUBSET_SEED).choice(rest, min(loss_nodes, len(rest)), replace=False)
    return np.union1d(needed, extra)


def open_prior(model: ModelSettings, mesh: Mesh, prior: Path | None, vibration: Path | None) -> PriorTable | None:
    """The response tables that a configuration uses; None where it uses none."""
    if not model.uses_prior:
        return None
    if prior is None:
        raise InputError("the configuration uses the linear response: pass --prior prior.safetensors")
    if model.vibration and vibration is None:
        raise InputError("the configuration uses free vibration: pass --vibration vibration.safetensors")
    return PriorTable(prior, mesh.node_count, vibration if model.vibration else None)


def make_trainer(
    settings: Settings, data: Path | list[Path], mesh: Mesh, table: PriorTable | None, out: Path, device: str
) -> Trainer:
    """`data`: one dataset, or several that are trained on together. `table`: what `open_prior` gave."""
    folders = [Path(data)] if isinstance(data, str | Path) else [Path(folder) for folder in data]
    datasets = [open_dataset(folder, mesh) for folder in folders]
    boundary = datasets[0].manifest.get("boundary", "fixed")
    for dataset in datasets[1:]:
        other = dataset.manifest.get("boundary", "fixed")
        if other != boundary:
            raise InputError(f"{dataset.folder}: boundary {other!r}, but {folders[0]} has {boundary!r}; train on one")
    graph = build_graph(mesh, settings.model.graph)
    t = settings.train
    nodes = training_nodes(mesh, graph, t.loss_nodes)

    def joined(split: str, count: int = 0) -> FieldCache:
        chosen = [(d.folder, d.select(split, t.schemes, count)) for d in datasets]
        if not any(cases for _, cases in chosen):
            raise InputError(f"{', '.join(map(str, folders))}: no {split} case; training needs both splits")
        parts = [build_cache(cache_of(folder, out), mesh, cases, nodes, table) for folder, cases in chosen if cases]
        return join_caches(parts)

    return Trainer(settings, out, mesh, graph, joined("train", t.train_cases), joined("test"), boundary, device)


def cache_of(folder: Path, out: Path) -> Path:
    """Where the arrays of a dataset's cases are kept: beside them where that can be written."""
    return folder / ".cache" if os.access(folder, os.W_OK) else Path(out) / "cache" / folder.name


def train_command(options) -> int:
    torch.set_num_threads(options.threads)
    device = choose_device(options.device)
    out = Path(options.out)
    if options.evaluate_minutes > 0 and (options.resume or options.max_minutes <= 0):
        raise InputError("--evaluate-minutes fills --max-minutes of a new run: give the latter, and leave out --resume")
    if options.resume and (out / "config.toml").exists():
        settings = load_settings(out / "config.toml")
    else:
        settings = load_settings(options.config)
    if not options.resume and (out / "last.pt").exists():
        raise InputError(f"{out}: already holds a run; pass --resume to continue it or another --out")
    ranks = int(os.environ.get("WORLD_SIZE", "1"))
    if ranks > 1:
        distributed.init_process_group("nccl" if device.startswith("cuda") else "gloo")
        if device == "cuda":
            device = f"cuda:{os.environ.get('LOCAL_RANK', '0')}"
    mesh = find_mesh(options.mesh, options.data[0])
    if ranks > 1 and distributed.get_rank() > 0:
        distributed.barrier()  # rank 0 makes the cache
    table = open_prior(settings.model, mesh, options.prior, options.vibration)
    trainer = make_trainer(settings, options.data, mesh, table, out, device)
    if ranks > 1 and distributed.get_rank() == 0:
        distributed.barrier()
    out.mkdir(parents=True, exist_ok=True)
    kept = out / "config.toml"
    if not options.resume and trainer.rank == 0 and not (kept.exists() and kept.samefile(options.config)):
        shutil.copyfile(options.config, kept)
    if options.resume and (out / "last.pt").exists():
        trainer.resume(out / "last.pt")
    elif options.init:
        trainer.start_from(options.init)
    if trainer.rank == 0:
        print(f"{settings.name}: {trainer.model.parameter_count()} parameters, {trainer.train_cache.case_count} cases, "
              f"{trainer.stepper.node_count} of {mesh.node_count} nodes, {trainer.total_steps} steps, "
              f"from step {trainer.step_count}, {device}", flush=True)  # fmt: skip
    ended = trainer.fit(
        options.max_minutes,
        checkpoint_minutes=options.checkpoint_minutes,
        evaluate_minutes=options.evaluate_minutes,
    )
    if trainer.rank == 0:
        print(
            f"{ended} at step {trainer.step_count}; best autoregressive MSE {trainer.best:.5f} mm²",
            flush=True,
        )
    if ranks > 1:
        # A rank that ends while another still talks to it aborts in gloo's threads
        # ("terminate called without an active exception").
        distributed.barrier()
        distributed.destroy_process_group()
        # So may one whose interpreter is taken down around a thread of gloo's. All files are written.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)
    return 0
