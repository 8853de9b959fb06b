"""Builds a reduced bundle from a mesh, its compliance columns and datasets; every stage is kept in a work folder.

Stages: modes (SVD), states (projection of every case), training, tables (block basis), bundle, evaluation. A stage
whose file exists is not repeated, so an interrupted build resumes; training resumes at its last checkpoint.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import torch

from upt_training.bundle_folder import read_manifest, write_manifest
from upt_training.envelope import prescribed
from upt_training.errors import InputError
from upt_training.loads import TWO_INSTRUMENTS, WITHHELD
from upt_training.mesh_file import Mesh, load_mesh
from upt_training.reduced.columns import Columns, load_columns
from upt_training.reduced.evaluate import evaluate, table
from upt_training.reduced.export import Description, tables_of, write_reduced_bundle
from upt_training.reduced.kept import kept_tables, write_retrained
from upt_training.reduced.make_prior import check_columns
from upt_training.reduced.modes import Modes, learn_modes
from upt_training.reduced.network import Correction
from upt_training.reduced.prior import Prior, load_prior, save_prior
from upt_training.reduced.rollout import Limits
from upt_training.reduced.states import States, join_states, load_states, project_cases
from upt_training.reduced.statics import Statics, join_statics, load_statics, project_statics
from upt_training.reduced.train import Settings, train
from upt_training.reduced.trajectories import DAMPING_PER_S, Case, open_dataset
from upt_training.reduced.transfer import Source, interpolation


@dataclass
class Options:
    """What the command line gives."""

    mesh: Path
    columns: Path
    data: list[Path]
    out: Path
    work: Path
    name: str
    coarse_mesh: Path | None = None
    coarse_columns: Path | None = None
    coarse_data: list[Path] = field(default_factory=list)
    modes: int = 120
    response_modes: int = 80
    tolerance_mm: float = 3e-3
    tables: str = "f16"
    near_mm: float | None = None
    keep: Path | None = None
    seeds: int = 1
    refit: bool = False


class Progress:
    """One line on stderr with the share done and the time left, at most twice a second."""

    def __init__(self, label: str) -> None:
        self.label, self.started, self.printed = label, time.monotonic(), 0.0

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self.printed < 0.5 and done < total:
            return
        self.printed = now
        left = (now - self.started) / max(done, 1) * (total - done)
        end = "\n" if done == total else ""
        print(f"\r{self.label}: {done}/{total}, {left:.0f} s left   ", end=end, file=sys.stderr, flush=True)


def sources_of(options: Options, mesh: Mesh, columns: Columns) -> list[tuple[str, Source]]:
    """Each dataset with the columns of its mesh; those of the coarse mesh with the interpolation to `mesh`."""
    out = [(folder.name, Source(columns, open_dataset(folder, mesh.sha256))) for folder in options.data]
    if options.coarse_data:
        if options.coarse_mesh is None or options.coarse_columns is None:
            raise InputError("--coarse-data needs --coarse-mesh and --coarse-columns")
        coarse, coarse_columns = load_mesh(options.coarse_mesh), load_columns(options.coarse_columns)
        check_columns(coarse, coarse_columns)
        transfer = interpolation(coarse, mesh)
        for folder in options.coarse_data:
            out.append((f"coarse-{folder.name}", Source(coarse_columns, open_dataset(folder, coarse.sha256), transfer)))
    return out


def learned_modes(options: Options, sources: list[tuple[str, Source]]) -> Modes:
    """Residual and response modes of the training cases, from the work folder where they were made before."""
    path = options.work / "modes.npz"
    if path.exists():
        with np.load(path) as file:
            return Modes(**{name: file[name] for name in file.files})
    training = [Source(s.columns, trainable(s.cases), s.transfer) for _, s in sources]
    modes = learn_modes(training, options.modes, options.response_modes, progress=Progress("modes"))
    np.savez(path.with_suffix(".partial.npz"), **vars(modes))
    path.with_suffix(".partial.npz").rename(path)
    return modes


def projected(options: Options, sources: list[tuple[str, Source]], modes: Modes) -> States:
    """States of every moving case of every dataset; cases that were added since the last build are projected."""
    parts = []
    for name, source in sources:
        path = options.work / f"states-{name}.npz"
        kept = [load_states(path)] if path.exists() else []
        known = set(kept[0].source) if kept else set()
        new = [case for case in source.cases if not case.is_static and case.path.name not in known]
        if source.transfer is not None:  # unseen cases of another mesh are not used at all
            new = [case for case in new if case.split == "train"]
        if new:
            part = project_cases(Source(source.columns, new, source.transfer), modes, Progress(f"states of {name}"))
            other = np.array([case.damping_per_s != DAMPING_PER_S for case in new])
            part.split = np.where(other & (part.split == "train"), "other", part.split)
            if source.transfer is not None:
                part.split = np.where(part.split == "train", "coarse", part.split)
            join_states([*kept, part]).save(path)
        if path.exists():
            parts.append(load_states(path))
    if not parts:
        raise InputError("no moving case: equilibria say nothing of a release; add a dataset of schemes or probes")
    return join_states(parts)


def projected_statics(options: Options, sources: list[tuple[str, Source]], modes: Modes) -> Statics | None:
    """Equilibria of every dataset, projected where they are new; None where there are none."""
    parts = []
    for name, source in sources:
        path = options.work / f"statics-{name}.npz"
        kept = [load_statics(path)] if path.exists() else []
        known = set(kept[0].source) if kept else set()
        new = [case for case in source.cases if case.is_static and case.path.name not in known]
        if new:
            source = Source(source.columns, new, source.transfer)
            part = project_statics(source, modes, Progress(f"equilibria of {name}"))
            joined = join_statics([*kept, part])
            assert joined is not None
            joined.save(path)
        if path.exists():
            parts.append(load_statics(path))
    return join_statics(parts)


def trainable(cases: list[Case]) -> list[Case]:
    """Cases of the split `train` with the bundle's own damping, scheme 5 never."""
    return [
        case
        for case in cases
        if case.split == "train" and case.scheme != WITHHELD and case.damping_per_s == DAMPING_PER_S
    ]


def split_states(states: States) -> tuple[States, States, States]:
    """Training, validation (every ninth training case, so schemes alternate) and test states.

    Scheme 5 is only ever tested. Where there are coarse cases, every fifth validates; with fewer than four fine cases
    coarse ones do. Interpolated coarse cases (split `coarse`; their test cases are not used at all) are trained on, but
    for those of the same index as a validation case: equal seeds may choose the same site.
    """
    own = np.flatnonzero((states.split == "train") & (states.scheme != WITHHELD))
    coarse = (states.split == "coarse") & (states.scheme != WITHHELD)
    pool = own if len(own) > 3 else np.flatnonzero(coarse)
    held_out = np.zeros(states.cases, bool)
    held_out[pool[3::5] if coarse.any() else pool[5::9]] = True
    fit = coarse & ~np.isin(states.source, states.source[held_out])
    fit[own] = True
    return (
        states.pick(fit & ~held_out),
        states.pick(held_out),
        states.pick((states.split == "test") | own_scheme_5(states)),
    )


def training_states(states: States) -> States:
    """Every training case, those that validate too."""
    return states.pick(np.isin(states.split, ["train", "coarse"]) & (states.scheme != WITHHELD))


def own_scheme_5(states: States) -> np.ndarray:
    """Cases of scheme 5 on the model's own mesh."""
    return (states.scheme == WITHHELD) & ~np.char.startswith(states.split, "coarse")


def bound_limits(states: States, statics: Statics | None = None) -> Limits:
    """`relative` that leaves the true residuals of training inside the bound with a half to spare."""
    pressed = states.contact & (states.push > 1.0)
    norm = np.linalg.norm(states.b, axis=2)
    share = norm[pressed] / np.maximum(states.response_norm[pressed], 1e-6)
    if statics is not None:
        at_rest = np.linalg.norm(statics.b, axis=1) / np.maximum(statics.response_norm, 1e-6)
        share = np.concatenate([share, at_rest[statics.push > 1.0]])
    return Limits(relative=float(np.clip(1.5 * np.quantile(share, 0.999), 0.2, 1.5)))


def trained(
    options: Options, states: States, statics: Statics | None, settings: Settings
) -> tuple[Correction, Limits, dict]:
    """The best of `seeds` trainings by validation error."""
    fit, validation, _ = split_states(states)
    if settings.updates == 0:  # Nothing is chosen by validation: the ridge regressions take every training case.
        fit = training_states(states)
    limits = bound_limits(fit, statics)
    best: tuple[Correction, dict] | None = None
    for seed in range(1, options.seeds + 1):
        settings.seed = seed
        model, history = train(fit, validation, limits, settings, print, options.work / f"training-{seed}.pt", statics)
        history["training_cases"] = fit.cases
        if best is None or history["validation_mse"] < best[1]["validation_mse"]:
            best = (model, {**history, "seed": seed})
    assert best is not None
    if options.refit and settings.updates:
        # What was set aside for the choice is too dear to leave out: once more on every training case.
        settings.seed = best[1]["seed"]
        everything = training_states(states)
        checkpoint = options.work / f"training-{settings.seed}-all.pt"
        model, _ = train(everything, validation, limits, settings, print, checkpoint, statics)
        return model, limits, {**best[1], "training_cases": everything.cases}
    return best[0], limits, best[1]


def tables(options: Options, mesh: Mesh, columns: Columns, modes: Modes) -> tuple[Prior, dict]:
    """Bundle tables, from the work folder where they were made before."""
    path, info_path = options.work / "tables.safetensors", options.work / "tables.json"
    if path.exists() and info_path.exists():
        return load_prior(path), json.loads(info_path.read_text())
    prior, info = tables_of(mesh, columns, modes, options.tolerance_mm, Progress("block basis"))
    save_prior(path, prior, np.float32)
    info_path.write_text(json.dumps(info))
    return prior, info


def envelope_of(cases: list[Case], mesh: Mesh) -> dict:
    """What the training cases cover: pushes, their rate, and areas of a patch, those of one instrument.

    Two instruments that adjoin make a patch larger than any that was pushed as a whole. Tools have limits of their own.
    """
    cases = prescribed(cases)
    areas = mesh.node_areas()
    push, rate, area = 0.0, 0.0, []
    for case in cases:
        for t in range(1, case.frames):
            row, before = case.contact_row(t), case.contact_row(t - 1)
            if not len(row):
                continue
            vectors = case.vectors[case.offsets[t] : case.offsets[t + 1]]
            push = max(push, float(np.linalg.norm(vectors, axis=1).max()))
            if case.scheme not in TWO_INSTRUMENTS:
                area.append(float(areas[row].sum()))
            if np.array_equal(row, before) and not case.is_static:
                earlier = case.vectors[case.offsets[t - 1] : case.offsets[t]]
                rate = max(rate, float(np.linalg.norm(vectors - earlier, axis=1).max()))
    if not area:
        raise InputError("every training case has two instruments: the area of one patch is not known; add others")
    # Sites and frames that were not drawn differ a little from those that were: 5 % on the rate, a quarter on the area.
    return {
        "max_push_mm": round(push, 2),
        "max_push_rate_mm": round(1.05 * rate, 2),
        "contact_area_mm2": [round(0.75 * min(area), 1), round(1.25 * max(area), 1)],
        "max_sites": 2 if any(case.scheme in TWO_INSTRUMENTS for case in cases) else 1,
        "displacement_bound_mm": round(2.0 * push, 1),
    }


def area_on(area_mm2: float, spacing_mm: float, other_mm: float) -> float:
    """Nodal area of a patch on a mesh of spacing `other_mm` that has `area_mm2` at `spacing_mm`.

    The nodes' areas reach half a spacing beyond the patch, which is taken as round.
    """
    radius = np.sqrt(area_mm2 / np.pi) + (other_mm - spacing_mm) / 2.0
    return float(np.pi * max(radius, other_mm / 2.0) ** 2)


def envelope(options: Options, made: Prepared) -> dict:
    """What the training cases cover; those of another mesh where there are no own ones, their areas sampled anew."""
    own = trainable(made.own)
    if own or options.coarse_mesh is None:
        return envelope_of(own or made.cases, made.mesh)
    other = load_mesh(options.coarse_mesh)
    covered = envelope_of(made.cases, other)
    spacings = [np.sqrt(mesh.node_areas()[mesh.domain_nodes].mean()) for mesh in (other, made.mesh)]
    covered["contact_area_mm2"] = [round(area_on(area, *spacings), 1) for area in covered["contact_area_mm2"]]
    return covered


@dataclass
class Prepared:
    """What does not depend on the correction: meshes, cases, modes, states and tables."""

    mesh: Mesh
    columns: Columns
    names: list[str]
    own: list[Case]
    cases: list[Case]
    states: States
    statics: Statics | None
    prior: Prior
    block_basis: dict


def check_work(options: Options) -> None:
    """Refuses a work folder whose states are in other modes: those of a build of its own, or of another kept bundle."""
    marker = options.work / "modes-of.txt"
    wanted = "this build"
    if options.keep is not None:
        wanted = read_manifest(options.keep)["files"]["prior.safetensors"]["sha256"]
    found = marker.read_text() if marker.exists() else "this build"
    if any(options.work.glob("stat*-*.npz")) and found != wanted:
        raise InputError(f"{options.work}: its states are in the modes of another bundle; give --keep its own --work")
    marker.write_text(wanted)


def prepare(options: Options) -> Prepared:
    """Everything before the training; what the work folder holds is not made again."""
    torch.set_num_threads(1)
    options.work.mkdir(parents=True, exist_ok=True)
    mesh, columns = load_mesh(options.mesh), load_columns(options.columns)
    check_columns(mesh, columns)
    sources = sources_of(options, mesh, columns)
    own = [case for _, source in sources if source.transfer is None for case in source.cases]
    cases = trainable([case for _, source in sources for case in source.cases])
    if not cases:
        raise InputError("no finished case of the split 'train': make the dataset with `upt dataset`")
    check_work(options)
    if options.keep is not None:
        modes, prior, info = kept_tables(options.keep, mesh, columns)
    else:
        modes = learned_modes(options, sources)
        prior, info = tables(options, mesh, columns, modes)
    states, statics = projected(options, sources, modes), projected_statics(options, sources, modes)
    return Prepared(mesh, columns, [name for name, _ in sources], own, cases, states, statics, prior, info)


def finish(options: Options, settings: Settings, description: str, made: Prepared) -> dict:
    """Training, bundle and evaluation; returns the errors by method and group."""
    model, limits, history = trained(options, made.states, made.statics, settings)
    digest = hashlib.sha256("".join(sorted(made.states.source)).encode()).hexdigest()[:12]
    provenance = {
        "data": made.names,
        "cases": {"train": len(made.cases), "all": made.states.cases, "files_sha256": digest},
        "equilibria": made.statics.count if made.statics else 0,
        "training": {
            **asdict(settings),
            "refit": options.refit,
            "validation_mse_mm2": history["validation_mse"] if settings.updates else None,
        },
        "block_basis": made.block_basis,
        "tables": options.tables,
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "command": "python -m upt_training.reduced build",
    }
    about = Description(options.name, description, envelope(options, made), provenance)
    if options.keep is not None:
        manifest = write_retrained(options.keep, options.out, made.mesh, made.columns, model, limits, about)
    else:
        dtype = np.float16 if options.tables == "f16" else np.float32
        manifest = write_reduced_bundle(
            options.out, made.mesh, made.columns, made.prior, model, limits, about, dtype, options.near_mm
        )
    tested = [case for case in made.own if case.split == "test" or case.scheme == WITHHELD]
    result = evaluate(options.out, tested, Progress("evaluation")) if tested else {"reduced": {}}
    manifest["errors"] = {group: _published(e) for group, e in result["reduced"].items()}
    write_manifest(options.out, manifest)
    (options.work / "errors.json").write_text(json.dumps(result, indent=2))
    return result


def build(options: Options, settings: Settings, description: str) -> dict:
    """A bundle from nothing but its inputs; returns the errors by method and group."""
    result = finish(options, settings, description, prepare(options))
    print(table(result))
    return result


def _published(errors: dict) -> dict:
    return {name: value if isinstance(value, int) else float(f"{value:.4g}") for name, value in errors.items()}
