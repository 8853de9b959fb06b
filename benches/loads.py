"""What loads cost: a step under a tool with gravity that turns, a pulse and a support that moves, over one without.

Scenes of one bundle, each with its own loads, make the same press in turns; the time is that of the calling thread,
which makes all of the step. Prints medians, ms, and their ratio to the scene without loads.

    python benches/loads.py onnx/brain-reduced --steps 110
"""

import argparse
import math
import time

import numpy as np
import upt

RADIUS_MM = 6.0
KINDS = ("none", "gravity", "pulse", "support", "all")


def loads(kind: str, step: int) -> upt.Loads | None:
    """The loads of a kind at the end of a step of 50 ms."""
    now = 0.05 * step
    fields = {}
    if kind in ("gravity", "all"):
        angle = 0.25 * math.pi * now
        fields["gravity"] = (0.3 * math.sin(angle), -0.3 * math.cos(angle), 0.0)
        fields["gravity_at_rest"] = (0.0, -0.3, 0.0)
    if kind in ("pulse", "all"):
        fields["pressures"] = [(None, 22 * math.sin(2 * math.pi * 1.2 * now))]
    if kind in ("support", "all"):
        height = 7.5 * (1 - math.cos(0.5 * math.pi * now))
        fields["support"] = ((0.0, 0.0, height), (0.0, 0.0, 0.0, 1.0))
    return upt.Loads(**fields) if fields else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle")
    parser.add_argument("--steps", type=int, default=110)
    parser.add_argument("--depth", type=float, default=6.0, help="of the press, mm")
    asked = parser.parse_args()
    model = upt.Model(asked.bundle, threads=1)
    domain = model.positions[model.indices(upt.IndexSet.DOMAIN_NODES)]
    site = domain[np.argmin(((domain - domain.mean(axis=0)) ** 2).sum(axis=1))]
    outward = site - model.positions.mean(axis=0)
    outward /= np.linalg.norm(outward)
    scenes = {kind: model.scene() for kind in KINDS}
    times = {kind: [] for kind in KINDS}
    for step in range(asked.steps):
        depth = asked.depth * (1 + 2 * math.sin(math.pi * step / 20) ** 2) / 3
        ball = upt.Instrument.capsule(radius=RADIUS_MM, position=tuple(site + outward * (RADIUS_MM - depth)))
        for kind, scene in scenes.items():
            own = loads(kind, step)
            start = time.thread_time()
            scene.step([ball], loads=own)
            times[kind].append(1e3 * (time.thread_time() - start))
    # The first steps of a scene make what the others have.
    medians = {kind: float(np.median(own[5:])) for kind, own in times.items()}
    for kind, median in medians.items():
        print(f"{kind:8} {median:7.3f} ms {median / medians['none']:6.3f}")


if __name__ == "__main__":
    main()
