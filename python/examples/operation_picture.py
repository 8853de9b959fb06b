"""The moving pictures of docs/guide/cutting.md: a tumour leaves a brain, and a blade opens a liver.

    pip install "./python[examples]"
    python python/examples/operation_picture.py resect --bundle onnx/brain --out docs/images/resected-brain.webp
    python python/examples/operation_picture.py incise --bundle onnx/liver-coarse --out docs/images/cut-liver.webp

A frame is a step of 50 ms, so the pictures run in real time. *Resect*: a ball of tissue is made three times as stiff,
an aspirator takes it, and a rod presses the wall of what it leaves. *Incise*: a blade that feels the tissue cuts, and a
rod takes hold of one lip and pulls it aside. Lengths in mm.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import upt
from cut_picture import HALF_LENGTH, HIGH, INSIDE, OUTSIDE, RADIUS, STEEL, WIDE, Part, draw, rod
from moving_picture import camera, turn_to
from PIL import ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
TUMOUR = np.array([98, 62, 104])
TUMOUR_RADIUS, TUMOUR_DEPTH, SHOWN = 6.5, 6.0, 5.0  # stiff so far from its middle, and shown as a tumour
ASPIRATOR, RATE = 4.0, 1200.0  # radius, mm³/s
SLIT, SLIT_DEPTH, EDGE = 40.0, 14.0, 28.0
DT = 0.05


class Site:
    """The outermost place near the middle of the domain, its outward normal, and two directions along the surface."""

    def __init__(self, model: upt.Model) -> None:
        rest, domain = model.positions.astype(float), model.domain_nodes
        middle, organ = rest[domain].mean(axis=0), rest.mean(axis=0)
        close = rest[domain][np.linalg.norm(rest[domain] - middle, axis=1) < 30]
        self.at = close[np.argmax((close - organ) @ (middle - organ))]
        near = rest[model.domain_faces]
        near = near[np.linalg.norm(near.mean(axis=1) - self.at, axis=1) < 15]
        normal = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]).sum(axis=0)
        self.normal = normal / np.linalg.norm(normal)
        along = np.cross(self.normal, [0.0, 0.0, 1.0])
        self.along = along / np.linalg.norm(along)
        self.across = np.cross(self.along, self.normal)

    def place(self, along: float, across: float, above: float) -> np.ndarray:
        return self.at + along * self.along + across * self.across + above * self.normal


class Body:
    """What is drawn of the tissue: the surface, with a colour of its own for what was inside, and for a tumour."""

    def __init__(self, scene: upt.Scene, tumour: np.ndarray | None = None) -> None:
        self.scene, self.tumour = scene, tumour
        self.follow()

    def follow(self) -> None:
        surface = self.scene.surface()
        full = surface.triangles.any(axis=1)
        chosen = [surface.triangles[full & ~surface.inside], surface.triangles[full & surface.inside]]
        self.parts = []
        for faces, color in zip(chosen, (OUTSIDE, INSIDE), strict=True):
            colors = np.tile(color, (len(faces), 1))
            if self.tumour is not None and len(faces) > 0:
                far = np.linalg.norm(surface.rest[faces].mean(axis=1) - self.tumour, axis=1)
                colors[far < SHOWN] = TUMOUR
            self.parts.append((faces, colors))

    def near(self, site: np.ndarray, reach: float) -> list[Part]:
        at = self.scene.surface_positions().astype(float)
        parts = []
        for faces, colors in self.parts:
            close = np.linalg.norm(at[faces].mean(axis=1) - site, axis=1) < reach
            parts.append((at, faces[close], colors[close]))
        return parts


def needle(tip: np.ndarray, axis: np.ndarray, radius: float) -> Part:
    """A rod whose end is a ball of another radius, for the aspirator: the ball itself is not drawn."""
    vertices, faces, colors = rod(tip + HALF_LENGTH * axis, axis)
    middle = (vertices - tip) @ axis
    line = tip + middle[:, None] * axis
    return line + (vertices - line) * radius / RADIUS, faces, colors


def blade(low: np.ndarray, high: np.ndarray, ahead: np.ndarray, side: np.ndarray) -> Part:
    """A thin plate whose edge is the line from `low` to `high`."""
    back = -6.0 * ahead
    corners = [low, high, high + back, low + back]
    vertices = np.array([corner + way * 0.4 * side for way in (-1.0, 1.0) for corner in corners])
    quads = [(0, 1, 2, 3), (7, 6, 5, 4), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = ((corners.mean(axis=1) - vertices.mean(axis=0)) * normals).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces, np.tile(STEEL, (len(faces), 1))


def resect(model: upt.Model, scene: upt.Scene, site: Site) -> Iterator[tuple[list[Part], str]]:
    tumour = site.place(0.0, 0.0, -TUMOUR_DEPTH)
    middles = model.positions[model.tets].mean(axis=1)
    scene.scale_stiffness(np.flatnonzero(np.linalg.norm(middles - tumour, axis=1) < TUMOUR_RADIUS), 3.0)
    body, removed = Body(scene, tumour), 0.0
    axis = site.normal - 0.9 * site.across
    axis /= np.linalg.norm(axis)
    # Round and down, so that it is everywhere once.
    for step in range(56):
        turn, down = 0.55 * step, np.interp(step, [0, 8, 54], [6.0, 0.0, -2.0 * TUMOUR_DEPTH + 4.0])
        wide = np.interp(step, [6, 20, 40, 54], [0.0, 4.5, 4.5, 0.0])
        tip = site.place(wide * np.cos(turn), wide * np.sin(turn), down)
        taken = scene.remove(upt.Instrument.sphere(ASPIRATOR, position=tip), RATE * DT)
        removed += taken.removed_mm3
        if taken.is_changed:
            body.follow()
        scene.step()
        yield [*body.near(site.at, 48.0), needle(tip, axis, 1.6)], f"removed {removed / 1000:.2f} ml"
    removed += scene.drop_fragments().removed_mm3
    body.follow()
    for step in range(24):
        deep = np.interp(step, [0, 12, 18, 23], [6.0, -2.0 * TUMOUR_DEPTH - 3.5, -2.0 * TUMOUR_DEPTH - 3.5, 6.0])
        tip = site.place(0.0, 0.0, deep + RADIUS)
        center = tip + HALF_LENGTH * axis
        scene.step([upt.Instrument.capsule(RADIUS, HALF_LENGTH, position=center, rotation=turn_to(axis))])
        force = np.linalg.norm(scene.readings()[0].force)
        yield [*body.near(site.at, 48.0), rod(center, axis)], f"the wall of the cavity: {force:.0f} mN"


def incise(model: upt.Model, scene: upt.Scene, site: Site) -> Iterator[tuple[list[Part], str]]:
    body, area = Body(scene), 0.0
    feels = upt.Blade(fracture_energy=10.0)

    def edge(step: int) -> list[np.ndarray]:
        at = np.interp(step, [0, 30], [-0.5 * SLIT, 0.5 * SLIT])
        return [site.place(at, 0.0, -SLIT_DEPTH), site.place(at, 0.0, EDGE - SLIT_DEPTH)]

    for step in range(30):
        done = scene.cut([edge(step), edge(step + 1)], blade=feels)
        area += done.area_mm2
        if done.is_changed:
            body.follow()
        scene.step()
        tool = blade(*edge(step + 1), site.along, site.across)
        said = f"cut {area / 100:.1f} sq. cm, {np.linalg.norm(done.force):.0f} mN on the blade"
        yield [*body.near(site.at, 60.0), tool], said
    axis = site.normal - 0.9 * site.across
    axis /= np.linalg.norm(axis)
    rest, domain = model.positions.astype(float), model.domain_nodes
    lip = rest[domain[np.argmin(np.linalg.norm(rest[domain] - site.place(0.0, -4.0, 0.0), axis=1))]]
    for step in range(34):
        aside = np.interp(step, [4, 18, 26, 33], [0.0, 14.0, 14.0, 0.0])
        tip = lip + (RADIUS - 0.6) * site.normal + aside * (0.5 * site.normal - site.across)
        center = tip + HALF_LENGTH * axis
        tool = upt.Instrument.capsule(RADIUS, HALF_LENGTH, position=center, rotation=turn_to(axis), grasp=step > 1)
        scene.step([tool])
        force = np.linalg.norm(scene.readings()[0].force)
        yield [*body.near(site.at, 60.0), rod(center, axis)], f"the lip pulls with {force:.0f} mN"


def main() -> None:
    """Operates, and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("operation", choices=["resect", "incise"])
    parser.add_argument("--bundle", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    operate, bundle, out = {
        "resect": (resect, "onnx/brain", "docs/images/resected-brain.webp"),
        "incise": (incise, "onnx/liver-coarse", "docs/images/cut-liver.webp"),
    }[options.operation]
    model = upt.Model(options.bundle or ROOT / bundle)
    scene = model.scene(corrections=10, step_s=DT)
    site = Site(model)
    eye = site.normal + 0.75 * site.across - 0.2 * site.along
    view = camera(eye / np.linalg.norm(eye))
    font, frames = ImageFont.load_default(14), []
    for parts, said in operate(model, scene, site):
        image = draw(parts, view, site.at)
        ImageDraw.Draw(image).text((12, HIGH - 24), said, fill=(70, 70, 80), font=font)
        frames.append(image)
        if sys.stderr.isatty():
            print(f"\r{len(frames)} frames", end="", file=sys.stderr)
    target = options.out or ROOT / out
    target.parent.mkdir(parents=True, exist_ok=True)
    others = {"append_images": frames[1:], "duration": round(1000 * DT), "loop": 0, "quality": 82, "method": 6}
    frames[0].save(target, save_all=True, **others)
    print(f"{target}: {len(frames)} frames of {WIDE} x {HIGH}, {target.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main()
