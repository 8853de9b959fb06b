"""The picture of docs/guide/cutting.md: a blade cuts a brain, and a tool opens the slit.

    pip install "./python[examples]"
    python python/examples/cut_picture.py --bundle onnx/brain-reduced --out docs/images/cut-open.png

Left: the blade has passed, and nothing has moved. Right: a rod holds one lip and pulls it aside. What was inside has a
colour of its own, by the flag of each triangle of `Scene.surface`. Lengths in mm.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import upt
from moving_picture import camera, shaded, turn_to
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE, INSIDE, STEEL = np.array([216, 172, 164]), np.array([165, 40, 52]), np.array([150, 165, 180])
BACKGROUND = np.array([250, 250, 250])
WIDE, HIGH, SCALE = 480, 400, 6.5  # pixels, pixels a mm
RADIUS, HALF_LENGTH = 2.0, 14.0

Part = tuple[np.ndarray, np.ndarray, np.ndarray]


def draw(parts: list[Part], view: np.ndarray, middle: np.ndarray) -> Image.Image:
    """Triangle surfaces (vertices, faces, colours of faces), the nearest at each pixel; drawn large, then halved."""
    picture = np.tile(BACKGROUND, (2 * HIGH, 2 * WIDE, 1)).astype(np.uint8)
    nearest = np.full((2 * HIGH, 2 * WIDE), -np.inf)
    for vertices, faces, colors in parts:
        seen = (vertices - middle) @ view.T
        corners = np.stack([WIDE + 2 * SCALE * seen[:, 0], HIGH - 2 * SCALE * seen[:, 1], seen[:, 2]], axis=1)[faces]
        for (a, b, c), fill in zip(corners, shaded(vertices, faces, colors), strict=True):
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            low = np.maximum(np.floor(np.min([a, b, c], axis=0)[:2]), 0).astype(int)
            high = np.minimum(np.ceil(np.max([a, b, c], axis=0)[:2]) + 1, [2 * WIDE, 2 * HIGH]).astype(int)
            if area >= 0 or (low >= high).any():
                continue
            x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
            at_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
            at_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
            depth = a[2] + at_b * (b[2] - a[2]) + at_c * (c[2] - a[2])
            window = np.s_[low[1] : high[1], low[0] : high[0]]
            shown = (at_b >= 0) & (at_c >= 0) & (at_b + at_c <= 1) & (depth > nearest[window])
            nearest[window][shown] = depth[shown]
            picture[window][shown] = fill
    return Image.fromarray(picture).resize((WIDE, HIGH), Image.Resampling.BOX)


def rod(center: np.ndarray, axis: np.ndarray) -> Part:
    """A capsule, its shaft longer at the end away from the tissue."""
    side = np.cross(axis, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    rings = [(-HALF_LENGTH - RADIUS * np.cos(a), RADIUS * np.sin(a)) for a in np.linspace(0.05, np.pi / 2, 6)]
    rings += [(along, RADIUS) for along in (0.0, HALF_LENGTH + 40.0)]
    around = [np.cos(a) * side + np.sin(a) * other for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)]
    vertices = np.array([center + along * axis + radius * way for along, radius in rings for way in around])
    faces = []
    for ring in range(len(rings) - 1):
        for k in range(24):
            a, b = 24 * ring + k, 24 * ring + (k + 1) % 24
            faces += [(a, b, a + 24), (b, b + 24, a + 24)]
    return vertices, np.array(faces), np.tile(STEEL, (len(faces), 1))


def body(scene: upt.Scene, surface: upt.Surface) -> list[Part]:
    """The surface where it is now, what was inside apart, so that edges stay sharp."""
    at = scene.surface_positions().astype(float)
    full = surface.triangles.any(axis=1)
    chosen = [surface.triangles[full & ~surface.inside], surface.triangles[full & surface.inside]]
    return [
        (at, faces, np.tile(color, (len(faces), 1))) for faces, color in zip(chosen, (OUTSIDE, INSIDE), strict=True)
    ]


def main() -> None:
    """Cuts, opens, and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, default=ROOT / "onnx/brain-reduced")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images/cut-open.png")
    parser.add_argument("--length", type=float, default=32.0)
    parser.add_argument("--depth", type=float, default=12.0)
    parser.add_argument("--aside", type=float, default=9.0)
    options = parser.parse_args()
    model = upt.Model(options.bundle)
    scene = model.scene(corrections=10)
    rest, domain = model.positions.astype(float), model.domain_nodes
    site = rest[domain[np.argmin(np.linalg.norm(rest[domain] - rest[domain].mean(axis=0), axis=1))]]
    near = rest[model.domain_faces]
    near = near[np.linalg.norm(near.mean(axis=1) - site, axis=1) < 15]
    normal = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    along = np.cross(normal, [0.0, 0.0, 1.0])
    along /= np.linalg.norm(along)
    across = np.cross(along, normal)
    ends = site + 0.5 * options.length * np.array([[-1.0], [1.0]]) * along
    done = scene.cut([ends + height * normal for height in (8.0, -options.depth)])
    surface = scene.surface()
    eye = normal + 0.6 * across - 0.25 * along
    view = camera(eye / np.linalg.norm(eye))
    closed = draw(body(scene, surface), view, site)
    axis = normal - 0.9 * across
    axis /= np.linalg.norm(axis)
    lip = rest[domain[np.argmin(np.linalg.norm(rest[domain] - site + 4.0 * across, axis=1))]]
    for step in range(30):
        tip = lip + (RADIUS - 0.6) * normal + np.interp(step, [4, 24], [0.0, options.aside]) * (0.5 * normal - across)
        center = tip + HALF_LENGTH * axis
        tool = upt.Instrument.capsule(RADIUS, HALF_LENGTH, position=center, rotation=turn_to(axis), grasp=step > 1)
        scene.step([tool])
    force = np.linalg.norm(scene.readings()[0].force)
    opened = draw([*body(scene, surface), rod(center, axis)], view, site)
    picture = Image.new("RGB", (2 * WIDE, HIGH), tuple(BACKGROUND))
    picture.paste(closed, (0, 0))
    picture.paste(opened, (WIDE, 0))
    font, ink = ImageFont.load_default(14), (70, 70, 80)
    cut = f"cut: {options.length:.0f} mm long, {options.depth:.0f} mm deep"
    ImageDraw.Draw(picture).text((12, HIGH - 24), cut, fill=ink, font=font)
    ImageDraw.Draw(picture).text((WIDE + 12, HIGH - 24), f"opened: {force:.0f} mN on the rod", fill=ink, font=font)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    picture.save(options.out, optimize=True)
    said = f"{done.copied_count} copies of nodes, {force:.0f} mN, flags {scene.stats.flags}"
    print(f"{options.out}: {options.out.stat().st_size // 1024} kB, {said}")


if __name__ == "__main__":
    main()
