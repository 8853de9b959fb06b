"""`python -m upt_training.reduced step BUNDLE... --out FOLDER`: the prior of a body in whole steps.

`stepped.py` is the form. The first bundle is the body of the others, whose files stay as they are. The steps of the
basis follow from what sampled contacts and the modes of the bundle do in each coordinate.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file, save_file

from upt_training.bundle_folder import file_entry, file_of, new_bundle, read_manifest, write_manifest
from upt_training.mesh_file import load_mesh
from upt_training.reduced.patches import sample_forces
from upt_training.reduced.prior import Prior, load_prior
from upt_training.reduced.stepped import basis_tensors, response_tensors


def amplitudes_of(folder: Path, manifest: dict, prior: Prior, mode_mm: float) -> np.ndarray:
    """What sampled contacts and the bundle's modes do in each coordinate `[Q]`, mm."""
    mesh = load_mesh(file_of(folder, manifest, manifest["mesh"]["file"]))
    q = prior.coordinates(sample_forces(mesh, prior, 256))
    square = np.mean(q.astype(np.float64) ** 2, axis=0)
    entry = manifest["prior"]
    files = [entry[name] for name in ("vibration", "release", "residual") if name in entry]
    files += [manifest["corrections"]["file"]] if "corrections" in manifest else []
    for name in files:
        tensors = load_file(file_of(folder, manifest, name))
        modes = np.asarray(tensors.get("modes", tensors.get("residual")), np.float64)
        modes /= np.maximum(np.linalg.norm(modes, axis=1, keepdims=True), 1e-12)
        square += mode_mm**2 * (modes**2).sum(axis=0)
    return np.sqrt(square)


def step(bundles: list[Path], out: Path, response_step: float, basis_mm: float, mode_mm: float) -> dict:
    """Write the bundles with the first one's prior in steps; the others are predictors of that body."""
    body, manifest = bundles[0], read_manifest(bundles[0])
    name = manifest["prior"]["file"]
    path = file_of(body, manifest, name)
    prior = load_prior(path)
    amplitudes = amplitudes_of(body, manifest, prior, mode_mm)
    with open(path, "rb") as file:
        metadata = json.loads(file.read(int.from_bytes(file.read(8), "little"))).get("__metadata__")
    tensors = {key: value for key, value in load_file(path).items() if key != "response_ranks"}
    tensors |= response_tensors(prior.response, response_step) | basis_tensors(prior.basis.bases, amplitudes, basis_mm)
    about = {"response_mm_per_mn": response_step, "basis_mm": basis_mm, "mode_mm": mode_mm}
    for folder in bundles:
        manifest = read_manifest(folder)
        with new_bundle(out / folder.name) as made:
            for file in manifest["files"]:
                if (folder / file).exists() and (folder / file) != path:
                    shutil.copyfile(folder / file, made / file)
            if folder == body:
                save_file(dict(sorted(tensors.items())), str(made / name), metadata=metadata)
                (made / name).chmod(0o644)
                about["bytes"] = (made / name).stat().st_size
            place = made / name if folder == body else out / body.name / name
            listed = manifest["files"] | {name: file_entry(place)}
            manifest["provenance"]["stepped"] = {key: value for key, value in about.items() if key != "bytes"}
            write_manifest(made, manifest | {"files": listed})
    return about


def step_command(options: argparse.Namespace) -> None:
    about = step(options.bundles, options.out, options.response_step, options.basis_mm, options.mode_mm)
    print(json.dumps(about))
