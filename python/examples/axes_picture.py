"""The picture of the axes in docs/guide/meshes.md: a bundle's frame, and Unity's, on the same brain.

    pip install "./python[examples]"
    python python/examples/axes_picture.py --out docs/images/axes.png

Each panel has the same view from the left, behind and above. An arrow is an axis of that frame.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import upt
from loads_picture import HIGH, INK, ROOT, WIDE, Panel
from moving_picture import camera
from PIL import Image, ImageDraw, ImageFont

EYE = np.array([-0.8, -0.45, 0.4])
LENGTH_MM, HEAD_MM = 98.0, 7.0
COLORS = ([200, 40, 40], [30, 140, 60], [40, 80, 200])
# Axes of the frame in the bundle's, and what each is called.
FRAMES = {
    "a bundle, files, C, Python: right-handed, mm": (
        ((1, 0, 0), "x: right"),
        ((0, 1, 0), "y: anterior"),
        ((0, 0, 1), "z: superior"),
    ),
    "Unity: left-handed, metres; (x, y, z) becomes (x, z, y)": (
        ((1, 0, 0), "x: right"),
        ((0, 0, 1), "y: up"),
        ((0, 1, 0), "z: forward"),
    ),
}


def arrow(panel: Panel, start: np.ndarray, along: np.ndarray, color: list[int], name: str) -> None:
    """An axis with its name."""
    end = start + LENGTH_MM * along
    panel.line(np.stack([start, end]), color, 8)
    tip, back = panel.flat(np.stack([end, end - HEAD_MM * along]))[:, :2]
    ahead = (tip - back) / max(float(np.linalg.norm(tip - back)), 1e-6)
    aside = np.array([-ahead[1], ahead[0]])
    corners = [tip + 26 * ahead, tip + 16 * aside, tip - 16 * aside]
    panel.canvas.polygon([tuple(corner) for corner in corners], fill=tuple(color))
    place = tip + 44 * ahead
    panel.canvas.text(
        tuple(place), name, fill=tuple(color), font=ImageFont.load_default(30), anchor="rm" if ahead[0] < 0 else "lm"
    )


def main() -> None:
    """Draws both frames."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, default=ROOT / "onnx/brain")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images/axes.png")
    options = parser.parse_args()
    model = upt.Model(options.bundle)
    rest = model.positions.astype(float)
    view = camera(EYE / np.linalg.norm(EYE))
    middle = 0.5 * (rest.min(axis=0) + rest.max(axis=0))
    page = Image.new("RGB", (2 * WIDE, HIGH), (250, 250, 250))
    for column, (caption, axes) in enumerate(FRAMES.items()):
        panel = Panel(model, 0.68 * view, middle)
        panel.body(rest, np.zeros(len(rest)), 1.0)
        for color, (along, name) in zip(COLORS, axes, strict=True):
            arrow(panel, middle, np.array(along, float), color, name)
        image = panel.image.resize((WIDE, HIGH), Image.Resampling.BOX)
        ImageDraw.Draw(image).text((10, HIGH - 22), caption, fill=INK, font=ImageFont.load_default(13))
        page.paste(image, (column * WIDE, 0))
    page.save(options.out)


if __name__ == "__main__":
    main()
