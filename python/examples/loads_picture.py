"""The picture of docs/guide/loads.md: what holds and loads a liver, each as a step of libupt has it.

    pip install "./python[examples]"
    python python/examples/loads_picture.py --out docs/images/what-holds.png

Four states of one bundle: what holds it; gravity turned; a support that moves; a bed of ties that a thread tears.
Colour is how far the tissue has gone in the frame of what holds it. Lengths in mm.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import upt
from moving_picture import camera, shaded
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
TISSUE, MOVED, HELD, TIED, TORN = ([214, 168, 160], [150, 30, 50], [70, 78, 92], [40, 90, 190], [200, 130, 30])
BACKGROUND, INK = (250, 250, 250), (60, 60, 70)
WIDE, HIGH, SCALE = 400, 300, 1.75  # pixels, pixels a mm
EYE = np.array([-0.2, 0.95, 0.1])
BREATH_MM, STEPS, DRAWN = 15.0, 40, 50


class Panel:
    """One state of the organ."""

    def __init__(self, model: upt.Model, view: np.ndarray, middle: np.ndarray) -> None:
        self.model, self.view, self.middle = model, view, middle
        self.image = Image.new("RGB", (2 * WIDE, 2 * HIGH), BACKGROUND)
        self.canvas = ImageDraw.Draw(self.image)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points, and how near they are."""
        seen = (points - self.middle) @ self.view.T
        return np.stack([WIDE + 2 * SCALE * seen[:, 0], HIGH - 30 - 2 * SCALE * seen[:, 1], seen[:, 2]], axis=1)

    def body(self, at: np.ndarray, gone: np.ndarray, most: float) -> None:
        """The surface, its nodes at `at [K,3]`, coloured by `gone [K]` mm; what is held is dark."""
        faces = self.model.surface_faces
        share = np.clip(gone[faces].mean(axis=1) / most, 0, 1)[:, None]
        colors = (1 - share) * np.array(TISSUE) + share * np.array(MOVED)
        colors[np.isin(faces, self.model.fixed_nodes).all(axis=1)] = HELD
        corners = self.flat(at)[faces]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        front = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0
        fills = shaded(at, faces, colors).astype(int)
        for k in np.argsort(corners[:, :, 2].mean(axis=1)):
            if front[k]:
                self.canvas.polygon([tuple(corner[:2]) for corner in corners[k]], fill=tuple(fills[k]))

    def outline(self, at: np.ndarray) -> None:
        """Where the organ was, as the nodes of its surface."""
        for x, y, _ in self.flat(at[self.model.surface_nodes]):
            self.canvas.ellipse((x - 2, y - 2, x + 2, y + 2), fill=(196, 200, 208))

    def line(self, ends: np.ndarray, color: list[int], width: int) -> None:
        """From point to point."""
        self.canvas.line([tuple(end[:2]) for end in self.flat(ends)], fill=tuple(color), width=width)

    def finished(self, caption: str) -> Image.Image:
        """With its caption."""
        image = self.image.resize((WIDE, HIGH), Image.Resampling.BOX)
        ImageDraw.Draw(image).text((10, HIGH - 24), caption, fill=INK, font=ImageFont.load_default(13))
        return image


def main() -> None:
    """Steps the four states and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, default=ROOT / "onnx/liver-coarse")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images/what-holds.png")
    options = parser.parse_args()
    model = upt.Model(options.bundle)
    rest = model.positions.astype(float)
    view = camera(EYE / np.linalg.norm(EYE))
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    panels = []

    panel = Panel(model, view, middle)
    panel.body(rest, np.zeros(len(rest)), 1.0)
    panels.append(panel.finished("held: what is dark does not move"))

    def size(u: np.ndarray) -> np.ndarray:
        return np.linalg.norm(u, axis=1)

    scene = model.scene()
    for step in range(STEPS):
        angle = 0.5 * math.pi * min(step / 30, 1.0)
        gravity = (9.81 * math.sin(angle), -9.81 * math.cos(angle), 0.0)
        u = scene.step(loads=upt.Loads(gravity=gravity, gravity_at_rest=(0.0, -9.81, 0.0)))
    panel = Panel(model, view, middle)
    panel.body(rest + u, size(u), size(u).max())
    panels.append(panel.finished(f"gravity turns by 90 degrees: {size(u).max():.1f} mm at most"))

    scene = model.scene()
    for step in range(11):
        height = 0.5 * BREATH_MM * (1 - math.cos(0.1 * math.pi * step))
        u = scene.step(loads=upt.Loads(support=((0.0, 0.0, height), (0.0, 0.0, 0.0, 1.0))))
        if step == 8:
            lag, moved = u.astype(float), height
    panel = Panel(model, view, middle)
    panel.outline(rest)
    panel.body(rest + lag + [0.0, 0.0, moved], size(lag), size(lag).max())
    panels.append(
        panel.finished(f"its support has moved {moved:.0f} mm: the tissue lags {size(lag).max():.2f} mm at most")
    )

    scene = model.scene()
    domain = model.domain_nodes
    node = domain[np.argmax(rest[domain] @ (view[1] + 0.6 * view[2]))]
    site = rest[node]
    bed = scene.bed(site, 25, stiffness=400, break_force=600)
    out = view[1]
    for step in range(DRAWN):
        thread = upt.Tie([node], place=site + 0.45 * step * out, stiffness=100)
        u = scene.step(loads=upt.Loads(ties=[*bed, thread]))
    readings = scene.tie_readings()
    panel = Panel(model, view, middle)
    panel.body(rest + u, size(u), size(u).max())
    for tie, reading in zip(bed, readings, strict=False):
        anchor = np.array(tie.place, dtype=float)
        nodes, weights = np.array(tie.nodes, int), np.array(tie.weights)[: len(tie.nodes), None]
        end = (weights * (rest + u)[nodes]).sum(axis=0)
        if not reading.broken:
            panel.line(np.stack([anchor, end]), TIED, 3)
        x, y, _ = panel.flat(anchor[None])[0]
        panel.canvas.ellipse((x - 4, y - 4, x + 4, y + 4), fill=tuple(TORN if reading.broken else TIED))
    panel.line(np.stack([(rest + u)[node], site + 0.45 * DRAWN * out]), INK, 4)
    torn = sum(reading.broken for reading in readings)
    panels.append(panel.finished(f"a thread pulls at a bed of {len(bed)} ties: {torn} are torn"))

    picture = Image.new("RGB", (2 * WIDE, 2 * HIGH), BACKGROUND)
    for k, image in enumerate(panels):
        picture.paste(image, ((k % 2) * WIDE, (k // 2) * HIGH))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    picture.save(options.out, optimize=True)
    print(f"{options.out}: {options.out.stat().st_size // 1024} kB, {torn} of {len(bed)} ties torn")


if __name__ == "__main__":
    main()
