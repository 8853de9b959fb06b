"""Where is which better: a reduced bundle, a UPT bundle and linear elasticity on the same contacts, regime by regime.

A regime is a dataset folder: other materials, contacts outside of the domain, two instruments. Every method keeps the
material that it was made for. Linear elasticity is the reduced bundle's prior alone.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from upt_training.bundle_rollout import BundleRunner
from upt_training.errors import InputError
from upt_training.loads import WITHHELD
from upt_training.mesh_file import load_mesh
from upt_training.reduced.evaluate import CaseError, roll_case, zero_error
from upt_training.reduced.runner import ReducedRunner
from upt_training.reduced.trajectories import open_dataset


def compare(
    reduced: Path,
    upt: Path | None,
    regimes: list[tuple[str, Path]],
    every_case: bool,
    progress: Callable[[str], Callable[[int, int], None]],
) -> str:
    """Markdown table of mean squared error and largest error, a line a regime and method."""
    mesh = load_mesh(reduced / "mesh.safetensors")
    runner = ReducedRunner(reduced)
    network = BundleRunner(upt) if upt else None
    if network and network.mesh.sha256 != mesh.sha256:
        raise InputError(f"{upt}: made for another mesh than {reduced}")
    lines = [
        "| regime | cases | method | MSE, mm² | max error, mm | relative L2 |",
        "|---|---|---|---|---|---|",
    ]
    for label, folder in regimes:
        cases = open_dataset(folder, mesh.sha256)
        if not every_case:
            cases = [case for case in cases if case.split == "test" or case.scheme == WITHHELD]
        if not cases:
            raise InputError(f"{folder}: no finished case to compare on (use --all for every case)")
        found: dict[str, list[CaseError]] = {}
        show = progress(label)
        for index, case in enumerate(cases):
            runner.correct = False
            found.setdefault("zero", []).append(zero_error(case))
            found.setdefault("linear elasticity", []).append(roll_case(runner, case))
            runner.correct = True
            found.setdefault("reduced", []).append(roll_case(runner, case))
            if network:
                found.setdefault("UPT + prior", []).append(roll_case(network, case))
            show(index + 1, len(cases))
        least = min(np.mean([e.mse for e in errors]) for errors in found.values())
        for method, errors in found.items():
            mse = np.mean([e.mse for e in errors])
            text = f"**{mse:.4f}**" if mse == least else f"{mse:.4f}"
            lines.append(
                f"| {label} | {len(errors)} | {method} | {text} | {np.mean([e.max_mm for e in errors]):.2f} "
                f"| {np.mean([e.relative for e in errors]):.3f} |"
            )
    return "\n".join(lines)
