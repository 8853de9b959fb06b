"""Truth, prediction and error at five times of one held-out rollout, as in the paper's rollout figure.

    python training/scripts/picture_rollout.py BUNDLE TRAJECTORY OUT.png

Surface of the deformed mesh, seen from the side of the contact, coloured by displacement (rows 1, 2) and error (row 3).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pyvista
from matplotlib import colormaps, pyplot

from upt_training.bundle_rollout import BundleRunner
from upt_training.dataset import open_trajectory

FRAMES = (30, 70, 110, 132, 150)


def rollout(runner: BundleRunner, trajectory) -> tuple[list[np.ndarray], list[np.ndarray]]:
    truth, predicted = [], []
    runner.reset()
    for t in range(1, trajectory.frame_count):
        u = runner.step(*trajectory.contact(t))
        if t in FRAMES:
            truth.append(np.asarray(trajectory.displacement[t], np.float32))
            predicted.append(u.copy())
    return truth, predicted


def render(mesh, displacement: np.ndarray, value: np.ndarray, top: float, name: str, centre: np.ndarray) -> np.ndarray:
    faces = np.hstack([np.full((len(mesh.surface), 1), 3), mesh.surface]).ravel()
    surface = pyvista.PolyData(mesh.positions + displacement, faces)
    surface["value"] = value
    plotter = pyvista.Plotter(off_screen=True, window_size=(460, 400))
    plotter.set_background("white")
    plotter.add_mesh(surface, scalars="value", cmap=name, clim=(0, top), show_scalar_bar=False, smooth_shading=True)
    middle = mesh.positions.mean(axis=0)
    side = np.array([np.sign(centre[0] - middle[0]) * 330.0, 110.0, 60.0])
    plotter.camera_position = [tuple(middle + side), tuple(middle), (0, 0, 1)]
    plotter.camera.zoom(1.25)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return image


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("trajectory", type=Path)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    runner = BundleRunner(options.bundle)
    trajectory = open_trajectory(options.trajectory, runner.mesh)
    truth, predicted = rollout(runner, trajectory)
    site = np.asarray(json.loads(trajectory.metadata["site"]))
    top = max(float(np.linalg.norm(u, axis=1).max()) for u in truth)
    worst = max(float(np.linalg.norm(u - v, axis=1).max()) for u, v in zip(truth, predicted, strict=True))
    rows = (
        ("truth", truth, "viridis", top),
        ("prediction", predicted, "viridis", top),
        ("error", None, "magma", worst),
    )
    figure, axes = pyplot.subplots(3, len(truth), figsize=(2.5 * len(truth) + 1, 6.4), layout="constrained")
    for r, (label, fields, colours, limit) in enumerate(rows):
        for i, (u, v) in enumerate(zip(truth, predicted, strict=True)):
            shown = v if fields is None else fields[i]
            value = np.linalg.norm(u - v, axis=1) if fields is None else np.linalg.norm(shown, axis=1)
            axes[r, i].imshow(render(runner.mesh, shown, value, limit, colours, site))
            axes[r, i].set_xticks([])
            axes[r, i].set_yticks([])
            axes[r, i].spines[:].set_visible(False)
            if r == 0:
                axes[r, i].set_title(f"t = {FRAMES[i] * 0.05:.1f} s")
            if fields is None:
                axes[r, i].set_xlabel(f"max {value.max():.2f} mm")
        axes[r, 0].set_ylabel(label)
        scale = pyplot.cm.ScalarMappable(pyplot.Normalize(0, limit), colormaps[colours])
        figure.colorbar(scale, ax=axes[r], label="mm", shrink=0.8)
    scheme = trajectory.metadata.get("scheme")
    figure.suptitle(f"{runner.manifest['name']}, {options.trajectory.name}, scheme {scheme}, {len(runner.u)} nodes")
    figure.savefig(options.out, dpi=100)


if __name__ == "__main__":
    main()
