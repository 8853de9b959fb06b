"""The moving picture of the README: a tool presses a brain, slides, and lets go.

    pip install "./python[examples]"
    python python/examples/moving_picture.py --bundle onnx/brain-reduced --out docs/images/pressed-brain.gif

A frame is a step of the model (50 ms), so the picture runs in real time. NumPy and Pillow draw it: faces are sorted by
depth and filled from back to front. Lengths in mm.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import upt
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
TISSUE, PRESSED, STEEL = np.array([214, 168, 160]), np.array([150, 40, 60]), np.array([150, 165, 180])
BACKGROUND = (250, 250, 250)
LIGHT = np.array([-0.75, 0.35, 0.56])
HALF_LENGTH, RADIUS = 26.0, 4.0
SIZE, SCALE = (480, 372), 2.4  # pixels, pixels a mm


def camera(eye: np.ndarray) -> np.ndarray:
    """Rows: right, up and backward of a view from direction `eye`, z up."""
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def turn_to(axis: np.ndarray) -> tuple[float, float, float, float]:
    """The quaternion x, y, z, w that turns local y to `axis`."""
    half = np.array([0.0, 1.0, 0.0]) + axis
    half /= np.linalg.norm(half)
    x, y, z = np.cross([0.0, 1.0, 0.0], half)
    return float(x), float(y), float(z), float(half[1])


def capsule(center: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices `[n, 3]` and triangles of the tool, its shaft drawn longer than the part that touches."""
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    rings = [(-HALF_LENGTH - RADIUS * np.cos(a), RADIUS * np.sin(a)) for a in np.linspace(0.05, np.pi / 2, 6)]
    rings += [(along, RADIUS) for along in np.linspace(-HALF_LENGTH + 3.0, HALF_LENGTH + 40.0, 24)]
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    around = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other
    vertices = np.concatenate([center + along * axis + radius * around for along, radius in rings])
    faces = []
    for ring in range(len(rings) - 1):
        for k in range(24):
            a, b = 24 * ring + k, 24 * ring + (k + 1) % 24
            faces += [(a, a + 24, b), (b, a + 24, b + 24)]
    return vertices, np.array(faces)


def shaded(vertices: np.ndarray, faces: np.ndarray, colors: np.ndarray) -> np.ndarray:
    """`[m, 3]` colours of the faces under one light, with normals smoothed over the vertices."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    smooth = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(smooth, faces[:, k], normals)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True) + 1e-9
    bright = 0.35 + 0.65 * np.clip(smooth[faces].mean(axis=1) @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    return colors * bright[:, None]


def draw(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]], view: np.ndarray, middle: np.ndarray) -> Image.Image:
    """A picture of triangle surfaces, the later ones a little in front. Drawn twice as large, then halved."""
    polygons, depths, fills = [], [], []
    for part, (vertices, faces, colors) in enumerate(parts):
        seen = (vertices - middle) @ view.T
        flat = np.stack([SIZE[0] + 2 * SCALE * seen[:, 0], SIZE[1] - 24 - 2 * SCALE * seen[:, 1]], axis=1)
        corners = flat[faces]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        front = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0
        polygons.append(corners[front])
        depths.append(seen[faces[front], 2].mean(axis=1) + 1.5 * part)
        fills.append(shaded(vertices, faces, colors)[front])
    polygons, depths, fills = np.concatenate(polygons), np.concatenate(depths), np.concatenate(fills)
    image = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]), BACKGROUND)
    canvas = ImageDraw.Draw(image)
    for k in np.argsort(depths):
        canvas.polygon([tuple(corner) for corner in polygons[k]], fill=tuple(int(c) for c in fills[k]))
    return image.resize(SIZE, Image.Resampling.BOX)


def path(step: int) -> tuple[float, float]:
    """Depth of the tip and how far it slid, mm, at the end of a step."""
    depth = np.interp(step, [0, 4, 18, 34, 38], [-6.0, 0.0, 9.0, 9.0, -10.0])
    slid = np.interp(step, [18, 32], [0.0, 12.0])
    return float(depth), float(slid)


def main() -> None:
    """Steps the scene along the tool's path and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, default=ROOT / "onnx/brain-reduced")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/images/pressed-brain.gif")
    parser.add_argument("--frames", type=int, default=46)
    options = parser.parse_args()
    model = upt.Model(options.bundle)
    scene = model.scene()
    rest, faces, domain = model.positions.astype(float), model.surface_faces, model.domain_nodes
    site = rest[domain[np.argmin(np.linalg.norm(rest[domain] - rest[domain].mean(axis=0), axis=1))]]
    near = rest[model.domain_faces]
    near = near[np.linalg.norm(near.mean(axis=1) - site, axis=1) < 10]
    outward = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]).sum(axis=0)
    outward /= np.linalg.norm(outward)
    view = camera(np.array([-0.93, 0.28, 0.22]) / np.linalg.norm([-0.93, 0.28, 0.22]))
    lean = outward + 0.9 * view[1] + 0.5 * view[0]
    axis = lean / np.linalg.norm(lean)
    along = view[0] - (view[0] @ outward) * outward
    along /= -np.linalg.norm(along)
    font = ImageFont.load_default(14)
    frames = []
    for step in range(options.frames):
        depth, slid = path(step)
        tip = site - depth * outward + slid * along
        center = tip + (HALF_LENGTH + RADIUS) * axis
        probe = upt.Instrument.capsule(RADIUS, HALF_LENGTH, position=center, rotation=turn_to(axis), friction=0.1)
        u = scene.step([probe]).astype(float)
        force = float(np.linalg.norm(scene.readings()[0].force))
        # The deep red is for what the tool drags along, not for the sway of the whole hemisphere.
        amount = np.clip(np.linalg.norm(u, axis=1)[faces].mean(axis=1) / 13.0, 0, 1)[:, None] ** 2.2
        tissue = (rest + u, faces, TISSUE + amount * (PRESSED - TISSUE))
        vertices, triangles = capsule(center, axis)
        tool = (vertices, triangles, np.tile(STEEL, (len(triangles), 1)))
        image = draw([tissue, tool], view, rest.mean(axis=0))
        text = f"force on the tool {force:3.0f} mN,  largest displacement {np.linalg.norm(u, axis=1).max():.1f} mm"
        ImageDraw.Draw(image).text((12, 350), text, fill=(70, 70, 80), font=font)
        frames.append(image)
    # One palette for all frames and no dither: what stands still costs nothing.
    palette = frames[30].quantize(40, dither=Image.Dither.NONE)
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in frames]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    rest_of_them = {"append_images": frames[1:], "duration": round(1000 * model.dt), "loop": 0, "optimize": False}
    frames[0].save(options.out, save_all=True, **rest_of_them)
    print(f"{options.out}: {len(frames)} frames, {options.out.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main()
