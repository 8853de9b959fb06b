"""`python -m upt_training rest BUNDLE`: where a network's own free motion ends beside rest.

Rest is the tissue's only equilibrium without contact; what a network does there is its bias. A scene sleeps when it
is still and within 0.05 mm of rest, so it needs to know of a bias that is larger: `rest_displacement_mm`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from upt_training.bundle_folder import read_manifest, seal
from upt_training.bundle_rollout import BundleRunner

FIELD = "rest_displacement_mm"
# A step that moves no node by more than this has arrived, mm; a scene calls 2e-3 still.
ARRIVED_MM = 1e-4
STEPS = 400
# The manifest's limit: a larger one is no bias but another equilibrium.
LARGEST_MM = 1.0


def rest_displacement(bundle: Path) -> float | None:
    """Largest `|u|` of a node at the fixed point that the free motion from rest ends at, mm; None without one."""
    runner = BundleRunner(bundle)
    none, vectors = np.zeros(0, np.int64), np.zeros((0, 3), np.float32)
    for _ in range(STEPS):
        before = runner.u
        now = runner.step(none, vectors)
        if np.linalg.norm(now - before, axis=1).max() < ARRIVED_MM:
            largest = float(np.linalg.norm(now, axis=1).max())
            return largest if largest <= LARGEST_MM else None
    return None


def write_rest(bundle: Path) -> float | None:
    """Measures and writes it, rounded up to a micrometre; a bundle without a fixed point or a network has no entry."""
    found = rest_displacement(bundle) if read_manifest(bundle)["kind"] == "upt" else None
    seal(bundle, {FIELD: None if found is None else float(np.ceil(found * 1e3) / 1e3)})
    return found


def rest_command(options: argparse.Namespace) -> int:
    for bundle in options.bundle:
        found = write_rest(bundle)
        print(f"{bundle}: {'no fixed point near rest' if found is None else f'{found:.4f} mm'}")
    return 0
