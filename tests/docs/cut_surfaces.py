"""What a cut costs a host: `python tests/docs/cut_surfaces.py BUNDLE ... --markdown PAGE`.

A slit of 28 x 9 mm in the middle of the domain at 25 mm/s, half a millimetre a step of 20 ms; the surface is asked for
after each. Then a ball presses one lip, 5 mm deep. Corrections as the bundle recommends, from Python, on one thread.
Times are of the processor, so that other work on the machine counts little. Replaces what the page has between
the marks `cut surfaces`. Needs the package `upt`.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import upt

LENGTH, DEPTH, PIECES, ABOVE = 28.0, 9.0, 56, 3.0
RADIUS, PRESSED, PRESSES = 5.0, 5.0, 60
MARKS = ("<!-- begin: cut surfaces -->", "<!-- end: cut surfaces -->")


def place(model: upt.Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A point in the middle of the domain, the direction out of the tissue there, and one along it."""
    points = model.positions.astype(np.float64)
    corners = points[model.domain_faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    domain = points[model.domain_nodes]
    middle = domain[np.argmin(np.linalg.norm(domain - domain.mean(axis=0), axis=1))]
    near = np.linalg.norm(corners.mean(axis=1) - middle, axis=1) < 0.5 * LENGTH
    outward = normals[near].sum(axis=0)
    outward /= np.linalg.norm(outward)
    along = np.cross(outward, [0.0, 0.0, 1.0] if abs(outward[2]) < 0.9 else [1.0, 0.0, 0.0])
    return middle, outward, along / np.linalg.norm(along)


def timed(call) -> tuple[float, object]:
    """Milliseconds of the processor, and what came back."""
    begun = time.process_time()
    found = call()
    return 1e3 * (time.process_time() - begun), found


def figure(ms: float) -> str:
    """Two digits."""
    return f"{ms:.2g}" if ms < 10 else f"{ms:.0f}"


def pair(times: list[float]) -> str:
    """The median, and the 99th percentile."""
    return f"{figure(np.median(times))} ({figure(np.percentile(times, 99))})"


def measured(bundle: Path) -> list[str]:
    """The cells of a row."""
    model = upt.Model(bundle)
    scene = model.scene(step_s=0.02, threads=1)
    scene.step()
    first, _ = timed(scene.surface)
    cuts, steps, updates, changed, positions = [], [], [], [], []
    middle, outward, along = place(model)
    ends = np.stack([middle + ABOVE * outward, middle - DEPTH * outward])
    way = ends + np.linspace(-0.5, 0.5, PIECES + 1)[:, None, None] * LENGTH * along
    for piece in zip(way, way[1:], strict=False):
        cuts.append(timed(lambda piece=piece: scene.cut(list(piece), stroke=1))[0])
        steps.append(timed(scene.step)[0])
        spent, surface = timed(scene.surface)
        updates.append(spent)
        changed.append(len(surface.changed))
        positions.append(timed(scene.surface_positions)[0])
    lip, pressed = middle + 4.0 * np.cross(outward, along), []
    for press in range(PRESSES):
        deep = PRESSED * min(1.0, 2.0 * press / PRESSES)
        ball = upt.Instrument.sphere(RADIUS, position=lip + (RADIUS - deep) * outward)
        pressed.append(timed(lambda ball=ball: scene.step([ball]))[0])
    return [
        f"`{bundle.name}`",
        f"{len(model.positions):,}",
        pair(cuts),
        pair(steps),
        pair(pressed),
        figure(first),
        pair(updates),
        f"{np.median(changed):.0f} of {len(surface.triangles):,}",
        figure(np.median(positions)),
    ]


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", nargs="+", type=Path, metavar="BUNDLE")
    parser.add_argument("--markdown", type=Path, metavar="PAGE")
    options = parser.parse_args()
    head = [
        "bundle",
        "nodes",
        "a cut, ms",
        "its step, ms",
        "a step at the lip, ms",
        "first surface, ms",
        "the surface after a cut, ms",
        "slots that changed",
        "positions, ms",
    ]
    lines = [f"| {' | '.join(row)} |" for row in [head, *map(measured, options.bundles)]]
    lines.insert(1, "|---|" + "---:|" * (len(head) - 1))
    table = "".join(f"{line}\n" for line in lines)
    print(table, end="")
    if options.markdown:
        begin, end = MARKS
        text = options.markdown.read_text(encoding="utf-8")
        before, _, rest = text.partition(begin)
        after = rest.partition(end)[2]
        options.markdown.write_text(f"{before}{begin}\n{table}\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
