"""Two builds of libupt in turns on the same poses: time of a step and error, old beside new.

python benches/in_turns.py OLD NEW [--bundle onnx/brain-reduced] [--threads N] [--rounds N]

OLD and NEW are clones with a release build (`cargo build --release -p libupt`), for instance a worktree of an
earlier commit beside this one; each runs in a process of its own with its own bundle. A ball of 5 mm presses 7 mm
deep to and fro, or strokes over 20 mm of the surface, 4 mm deeper than where it would touch it. Prints a row for
each programme and number of corrections: median and 90 and 99 % of a step in contact, new over old, and the mean
square distance of both from the same steps with 60 corrections by NEW, mm².
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

PROGRAMMES = ["press", "stroke"]
#: Corrections; 0: as the bundle recommends, in steps for frames.
KINDS = [3, 10, 0]
CONVERGED = 60
STEPS = 60
RADIUS_MM = 5


def poses(programme, tip, inward, aside, positions):
    """Where the ball's lowest point is at the end of each step, and whether it is in the tissue."""
    for step in range(STEPS):
        if programme == "press":
            depth = 7 * (1 - abs(step % 30 - 15) / 15) if step else 0
            yield tip + depth * inward, depth > 0
        else:
            at = tip + 20 * min(max(step - 10, 0) / 40, 1) * aside
            yield at + (first_touch(at, inward, positions) + min(step, 10) * 0.4) * inward, step > 0


def first_touch(at, inward, positions):
    """How far the ball's lowest point goes inward from a place until the ball meets the first node at rest, mm."""
    import numpy as np

    apart = positions - at
    along = apart @ inward
    beside = ((apart - along[:, None] * inward) ** 2).sum(axis=1)
    below = beside < RADIUS_MM**2
    return (along[below] + RADIUS_MM - np.sqrt(RADIUS_MM**2 - beside[below])).min()


class Build:
    """What runs in the process of a build."""

    def __init__(self, bundle, threads):
        import numpy as np
        import upt

        self.np, self.upt = np, upt
        self.model = upt.Model(bundle, threads=threads)
        positions = self.positions = np.asarray(self.model.positions, float)
        domain = self.model.indices(upt.IndexSet.DOMAIN_NODES)
        middle = positions[domain].mean(axis=0)
        self.tip = positions[domain[np.argmin(((positions[domain] - middle) ** 2).sum(axis=1))]]
        inward = positions.mean(axis=0) - self.tip
        self.inward = inward / np.linalg.norm(inward)
        aside = np.cross(self.inward, [0.0, 0.0, 1.0])
        self.aside = aside / np.linalg.norm(aside)

    def run(self, programme, corrections):
        """Milliseconds of the steps in contact, and the field of every fifth of them."""
        options = {"step_s": self.model.frame_step_s}
        if corrections:
            options["corrections"] = corrections
        scene = self.model.scene(**options)
        step = getattr(scene, "step_instruments", None) or scene.step
        took, fields = [], []
        for at, touches in poses(programme, self.tip, self.inward, self.aside, self.positions):
            ball = self.upt.Instrument.capsule(float(RADIUS_MM), position=at - RADIUS_MM * self.inward)
            start = time.perf_counter()
            field = step([ball])
            if touches:
                took.append(1e3 * (time.perf_counter() - start))
                if len(took) % 5 == 0:
                    fields.append(field.copy())
        scene.close()
        return took, self.np.stack(fields)


def serve(bundle, threads, folder):
    """Answers requests, a line each; fields go to files of `folder`."""
    build = Build(bundle, threads)
    for line in sys.stdin:
        request = json.loads(line)
        took, fields = build.run(request["programme"], request["corrections"])
        build.np.save(Path(folder) / "fields.npy", fields)
        print(json.dumps(took), flush=True)


class Process:
    """A build's process."""

    def __init__(self, tree, options, folder):
        tree = Path(tree).resolve()
        library = tree / "target/release/libupt.so"
        bundle = tree / options.bundle
        for needed in (library, bundle):
            if not needed.exists():
                sys.exit(f"{needed} is missing: build the clone and name a bundle that it holds")
        self.folder = Path(folder)
        self.folder.mkdir()
        self.process = subprocess.Popen(
            [sys.executable, __file__, "--serve", str(bundle), str(options.threads), str(folder)],
            env={**os.environ, "PYTHONPATH": str(tree / "python"), "UPT_LIBRARY": str(library)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, programme, corrections):
        import numpy as np

        self.process.stdin.write(json.dumps({"programme": programme, "corrections": corrections}) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit("a build's process has ended; its error is above")
        return json.loads(line), np.load(self.folder / "fields.npy")


def main():
    import tempfile

    import numpy as np

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--bundle", default="onnx/brain-reduced", help="in both clones")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        old, new = (
            Process(tree, options, Path(folder) / name) for name, tree in (("old", options.old), ("new", options.new))
        )
        print("| programme | corrections | old, ms: median, 90 %, 99 % | new | new over old | MSE, mm²: old | new |")
        print("|---|---|---|---|---|---|---|", flush=True)
        for programme in PROGRAMMES:
            converged = new.run(programme, CONVERGED)[1]
            for corrections in KINDS:
                took, error = ([], []), [0.0, 0.0]
                for turn in range(options.rounds + 1):
                    for which, build in enumerate((old, new)):
                        times, fields = build.run(programme, corrections)
                        error[which] = float(3 * ((fields - converged) ** 2).mean())
                        if turn:  # the first one warms up
                            took[which].extend(times)
                quantiles = [np.quantile(times, [0.5, 0.9, 0.99]) for times in took]
                cells = [", ".join(f"{value:.1f}" for value in values) for values in quantiles]
                ratio = ", ".join(f"{value:.2f}" for value in quantiles[1] / quantiles[0])
                row = [programme, str(corrections or "recommended"), *cells, ratio, *(f"{e:.2g}" for e in error)]
                print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2], int(sys.argv[3]), sys.argv[4])
    else:
        main()
