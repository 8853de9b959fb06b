"""What a column a region would be worth: how far a step under a pressure on a patch is from the converged one.

Scenes of one bundle with different numbers of corrections get the same pressures on the nodes around the middle of the
domain: a pulse, and one that comes and goes at once every half second. Prints the mean squared distance from a scene
with 64 corrections, median and worst over the steps, mm². A column of the region's answer in the guess of a step could
take away no more than that.

    python benches/pressure_regions.py onnx/liver-coarse --pascal 400
"""

import argparse
import math

import numpy as np
import upt

CONVERGED = "64"
EFFORTS = {"1": {"corrections": 1}, "3": {"corrections": 3}, "recommended": {}, CONVERGED: {"corrections": 64}}
PROGRAMMES = {
    "pulse": lambda now: math.sin(2 * math.pi * 1.2 * now),
    "jump": lambda now: float(math.floor(2 * now + 1e-6) % 2),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle")
    parser.add_argument("--pascal", type=float, default=300.0, help="the largest pressure")
    parser.add_argument("--radius", type=float, default=14.0, help="of the region, mm")
    parser.add_argument("--steps", type=int, default=40)
    asked = parser.parse_args()
    model = upt.Model(asked.bundle, threads=1)
    domain = model.indices(upt.IndexSet.DOMAIN_NODES)
    places = model.positions[domain]
    site = places[np.argmin(((places - places.mean(axis=0)) ** 2).sum(axis=1))]
    region = domain[((places - site) ** 2).sum(axis=1) < asked.radius**2]
    print(f"{asked.bundle}: {model.node_count} nodes, {len(region)} of {len(domain)} of the domain under pressure")
    for name, programme in PROGRAMMES.items():
        scenes = {effort: model.scene(**options) for effort, options in EFFORTS.items()}
        errors = {effort: [] for effort in EFFORTS}
        farthest = 0.0
        for step in range(1, asked.steps + 1):
            loads = upt.Loads(pressures=[(region, asked.pascal * programme(step * model.dt))])
            states = {effort: np.array(scene.step(loads=loads)) for effort, scene in scenes.items()}
            converged = states[CONVERGED]
            farthest = max(farthest, float(np.linalg.norm(converged, axis=1).max()))
            for effort, state in states.items():
                errors[effort].append(float(((state - converged) ** 2).sum(axis=1).mean()))
        print(f"{name}: {farthest:.2f} mm at most")
        for effort, own in errors.items():
            if effort != CONVERGED:
                print(f"  {effort:12} {np.median(own):.1e} mm², worst {max(own):.1e}")


if __name__ == "__main__":
    main()
