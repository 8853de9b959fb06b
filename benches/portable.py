"""What the same bits on every machine cost: portable models over others, in turns, by instruction set.

python benches/portable.py [BUNDLE...]

A ball presses, slides and lifts, one thread, three corrections; a level runs in a process of its own (UPT_ISA).
Prints a row of a table for each level that this machine has: median milliseconds of a step either way, their
ratio, and the hash of what the portable model computed.
"""

import hashlib
import os
import statistics
import subprocess
import sys
import time

LEVELS = ["avx512", "avx2", "neon", "scalar"]
ROUNDS = 5


def rollout(model, hashed=None):
    """Milliseconds of the steps."""
    import numpy as np
    import upt

    scene = model.scene(corrections=3, step_s=0.02)
    tip = model.positions[model.indices(upt.IndexSet.DOMAIN_NODES)[0]]
    took = []
    for step in range(32):
        down = step if step < 16 else 16 if step < 24 else 40 - step
        aside = 0 if step < 16 else step - 16 if step < 24 else 8
        at = tip + np.float32([0.5 * aside, 0, 6 - 0.5 * down])
        ball = upt.Instrument.sphere(radius=6, position=at, friction=0.25)
        start = time.perf_counter()
        field = scene.step([ball])
        took.append(1e3 * (time.perf_counter() - start))
        if hashed is not None:
            hashed.update(field.tobytes())
    return took


def measure(bundle):
    """One row."""
    import upt

    models = [upt.Model(bundle, threads=1, portable=portable) for portable in (False, True)]
    hashed = hashlib.sha256()
    rollout(models[0])
    rollout(models[1], hashed)
    took = [[], []]
    for _ in range(ROUNDS):
        for which, model in enumerate(models):
            took[which] += rollout(model)
    usual, portable = (statistics.median(values) for values in took)
    row = [f"`{os.path.basename(bundle)}`", os.environ["UPT_ISA"], f"{usual:.2f}", f"{portable:.2f}"]
    row += [f"{portable / usual:.2f}", hashed.hexdigest()[:12]]
    print(f"| {' | '.join(row)} |")


def has(level):
    """Whether the machine runs it: else libupt takes another."""
    import platform

    if platform.machine() in ("aarch64", "arm64"):
        return level in ("neon", "scalar")
    with open("/proc/cpuinfo") as file:
        return level == "scalar" or level.replace("avx512", "avx512vl") in file.read().split()


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--one":
        measure(sys.argv[2])
    else:
        print("| bundle | kernels | step, ms | portable, ms | ratio | hash |\n|---|---|---|---|---|---|", flush=True)
        for bundle in sys.argv[1:] or ["onnx/liver-coarse"]:
            for level in filter(has, LEVELS):
                command = [sys.executable, __file__, "--one", bundle]
                subprocess.run(command, env={**os.environ, "UPT_ISA": level}, check=True)
