"""What relaxation costs in a step: a bundle with three Prony branches and without, in turns, for each build.

python benches/relaxation_cost.py LIBRARY [LIBRARY...] [--bundle onnx/brain-reduced] [--corrections 3] [--rounds 6]

A LIBRARY is a release build of libupt (`target/release/libupt.so`). A ball of 5 mm presses 7 mm deep within 15 steps
and is held for 15. Prints, for each library: processor time of one thread for a step (the least of the rounds for each
step, then the mean) without and with relaxation, their ratio, and how far the relaxing tissue's forces and nodes are
from those of the first library's steps of a fifth of the length with 20 corrections.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STEPS = 30
RADIUS_MM = 5
DEPTH_MM = 7
BRANCHES = [[0.45, 0.5], [0.3, 50.0], [0.1, 0.05]]
FINER = 5


def relaxing_copy(bundle: Path, folder: Path) -> Path:
    """The bundle with relaxation in its material."""
    shutil.copytree(bundle, folder)
    manifest = json.loads((folder / "bundle.json").read_text())
    if "body" in manifest:
        (folder.parent / manifest["body"]).symlink_to((bundle.parent / manifest["body"]).resolve())
    manifest["material"]["relaxation"] = [{"share": share, "tau_s": tau} for share, tau in BRANCHES]
    manifest.setdefault("requires", []).append("relaxation")
    blank = "0" * 64
    manifest["manifest_sha256"] = blank
    text = json.dumps(manifest)
    digest = hashlib.sha256(text.encode()).hexdigest()
    (folder / "bundle.json").write_text(text.replace(blank, digest))
    return folder


def depth_at(step: float) -> float:
    """How deep the ball is at the end of a step, mm."""
    return DEPTH_MM * min(step / 15, 1.0)


class Run:
    """A scene and the programme."""

    def __init__(self, upt, bundle: Path, **options):
        import numpy as np

        model = upt.Model(bundle)
        self.upt, self.scene = upt, model.scene(threads=1, **options)
        nodes = model.domain_nodes
        positions = np.asarray(model.positions)
        self.tip = positions[nodes[len(nodes) // 3]]
        self.inward = positions.mean(axis=0) - self.tip
        self.inward /= np.linalg.norm(self.inward)
        self.out = np.empty_like(positions, dtype=np.float32)

    def step(self, step: float) -> float:
        centre = self.tip + (depth_at(step) - RADIUS_MM) * self.inward
        ball = self.upt.Instrument.capsule(radius=RADIUS_MM, position=tuple(centre))
        start = time.thread_time()
        self.scene.step([ball], out=self.out)
        return 1e3 * (time.thread_time() - start)

    def force(self) -> float:
        import numpy as np

        return float(np.linalg.norm(self.scene.readings()[0].force))


def child(args) -> None:
    import numpy as np
    import upt

    if args.finer:
        run = Run(upt, args.relaxing, corrections=20, step_s=args.dt / FINER)
        fields, forces = [], []
        for step in range(1, STEPS + 1):
            for part in range(1, FINER + 1):
                run.step(step - 1 + part / FINER)
            fields.append(run.out.copy())
            forces.append(run.force())
        np.savez(args.child, fields=fields, forces=forces)
        return
    times = {"plain": [], "relaxing": []}
    for _ in range(args.rounds):
        runs = {"plain": Run(upt, args.bundle, corrections=args.corrections)}
        runs["relaxing"] = Run(upt, args.relaxing, corrections=args.corrections)
        rows = {name: [] for name in runs}
        fields, forces = [], []
        for step in range(1, STEPS + 1):
            for name, run in runs.items():
                rows[name].append(run.step(step))
            fields.append(runs["relaxing"].out.copy())
            forces.append(runs["relaxing"].force())
        for name, row in rows.items():
            times[name].append(row)
    least = {name: float(np.min(rows, axis=0).mean()) for name, rows in times.items()}
    np.savez(args.child, fields=fields, forces=forces, **least)


def start(args, library: Path, folder: Path, name: str, finer: bool, relaxing: Path) -> Path:
    out = folder / f"{name}.npz"
    own = ["--bundle", str(args.bundle), "--relaxing", str(relaxing), "--child", str(out)]
    for name in ["rounds", "corrections", "dt"]:
        own += [f"--{name}", str(getattr(args, name))]
    python = Path(__file__).resolve().parents[1] / "python"
    environment = {**os.environ, "UPT_LIBRARY": str(library), "PYTHONPATH": str(python)}
    command = [sys.executable, __file__, str(library), *own, *(["--finer"] if finer else [])]
    subprocess.run(command, check=True, env=environment)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("libraries", nargs="+", type=Path)
    parser.add_argument("--bundle", type=Path, default=Path("onnx/brain-reduced"))
    parser.add_argument("--corrections", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=6)
    for hidden in ["--child", "--relaxing"]:
        parser.add_argument(hidden, type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--finer", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--dt", type=float, default=0.05, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.child:
        return child(args)
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        relaxing = relaxing_copy(args.bundle, folder / "relaxing")
        args.dt = json.loads((args.bundle / "bundle.json").read_text())["dt_s"]
        first = args.libraries[0].resolve()
        truth = np.load(start(args, first, folder, "truth", True, relaxing))
        print("| library | plain, ms | relaxing, ms | ratio | force off, worst / mean % | MSE worst / mean, mm² |")
        print("|---|---:|---:|---:|---:|---:|")
        for library in args.libraries:
            own = np.load(start(args, library.resolve(), folder, "own", False, relaxing))
            pressed = truth["forces"] > 0.2 * truth["forces"].max()
            off = 100 * np.abs(own["forces"] - truth["forces"])[pressed] / truth["forces"].max()
            square = ((own["fields"] - truth["fields"]) ** 2).sum(axis=2).mean(axis=1)
            plain, slow = float(own["plain"]), float(own["relaxing"])
            print(
                f"| {library} | {plain:.2f} | {slow:.2f} | {slow / plain:.3f} "
                f"| {off.max():.2f} / {off.mean():.2f} | {square.max():.2e} / {square.mean():.2e} |"
            )


if __name__ == "__main__":
    main()
