"""What Python adds to a step: one loop in C and in Python, by turns on one scene.

    python python/benches/overhead.py --markdown PAGE

A step by nodes in contact, and one by an instrument beside the tissue. A turn is a row of steps from rest in C and the
same row in Python, each call timed by itself. A call's time is the median of all turns, what Python adds to it the
difference of the two, so that a busy machine or a clock that changes falls out. Prints the mean over the row, and the
least and the most of its calls. `--markdown` writes it between the page's marks. Needs a C compiler, `cc`.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import upt
from numpy.typing import NDArray
from page import machine, write
from upt._library import check, lib

ROOT = Path(__file__).resolve().parents[2]
Seconds = NDArray[np.float64]


def c_loop(scratch: str) -> Any:
    """`steps` of overhead.c, which calls the library that this process has loaded."""
    made = str(Path(scratch) / "overhead.so")
    source = str(Path(__file__).with_suffix(".c"))
    command = ["cc", "-O2", "-shared", "-fPIC", "-I", str(ROOT / "include"), source, lib._name, "-o", made]
    subprocess.run(command, check=True)
    # By this name it looks for the library; the one that is loaded has it already.
    steps = ctypes.CDLL(made).steps
    pointer, whole = ctypes.c_void_p, ctypes.c_uint64
    steps.argtypes = [pointer, pointer, pointer, pointer, whole, pointer, whole, ctypes.c_long, pointer]
    return steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-coarse-reduced"))
    parser.add_argument("--calls", type=int, default=10, help="steps of a row")
    parser.add_argument("--turns", type=int, default=600)
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()

    about = machine()
    lines = []
    with tempfile.TemporaryDirectory() as scratch, upt.Model(arguments.bundle) as model:
        steps = c_loop(scratch)
        nodes, vectors = model.domain_nodes[:4], np.tile(np.float32([0, 0, -1]), (4, 1))
        out = np.empty((model.node_count, 3), np.float32)
        where = [array.ctypes.data for array in (nodes, vectors)]
        tool = upt.Instrument.capsule(3.0, position=(500, 0, 0))
        record = tool.record()

        def by_nodes(scene: upt.Scene, seconds: Seconds) -> None:
            for i in range(len(seconds)):
                begin = time.perf_counter()
                scene.step(contacts=(nodes, vectors), out=out)
                seconds[i] = time.perf_counter() - begin

        def by_tool(scene: upt.Scene, seconds: Seconds) -> None:
            for i in range(len(seconds)):
                begin = time.perf_counter()
                scene.step([tool], out=out)
                seconds[i] = time.perf_counter() - begin

        for name, in_python in (("step(contacts=...)", by_nodes), ("step([tool])", by_tool)):
            described = ctypes.addressof(record) if in_python is by_tool else None

            def in_c(scene: upt.Scene, seconds: Seconds, described: int | None = described) -> None:
                tail = (out.ctypes.data, out.size, len(seconds), seconds.ctypes.data)
                check(steps(scene._handle, described, *where, len(nodes), *tail))

            with model.scene(sleep=False) as scene:
                found = {run: np.empty((arguments.turns, arguments.calls)) for run in (in_c, in_python)}
                for turn in range(arguments.turns):
                    for run in (in_c, in_python) if turn % 2 else (in_python, in_c):
                        scene.reset()
                        run(scene, found[run][turn])
            c, python = (1e6 * np.median(found[run], axis=0) for run in (in_c, in_python))
            added = python - c
            lines.append(
                f"| `{name}` | {c.mean():.0f} | {python.mean():.0f} | "
                f"{added.mean():.1f} ({added.min():.1f} to {added.max():.1f}) |"
            )
    rows = f"{arguments.turns} turns of {arguments.calls} steps in each language"
    head = [
        f"`{Path(arguments.bundle).name}`, {rows}. {about}.",
        "",
        "| call | in C, µs | in Python, µs | Python adds, µs (least to most of the row) |",
        "|---|---:|---:|---:|",
    ]
    write(arguments.markdown, "python/benches/overhead.py", "\n".join(head + lines))


if __name__ == "__main__":
    main()
