"""What Python adds to a step: the same loop in C and in Python, by turns.

    python python/benches/overhead.py --bundle onnx/brain-coarse-reduced --markdown docs/guide/python.md

A step by nodes in contact, and one by an instrument beside the tissue. Prints the median time of a call in each
language over all turns, and the difference of turns side by side. `--markdown` writes it between the page's marks.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import upt
from page import machine, write
from upt._library import lib, packaged_onnxruntime

ROOT = Path(__file__).resolve().parents[2]


def in_python(bundle: str, calls: int, by_tool: bool) -> list[float]:
    with upt.Model(bundle) as model, model.scene(no_sleep=True) as scene:
        nodes, vectors = model.domain_nodes[:4], np.tile(np.float32([0, 0, -1]), (4, 1))
        tool = upt.Instrument.capsule(3.0, position=(500, 0, 0))
        out, seconds = np.empty((model.node_count, 3), np.float32), []
        for _ in range(calls):
            begin = time.perf_counter()
            if by_tool:
                scene.step_instruments([tool], out)
            else:
                scene.step_contacts(nodes, vectors, out)
            seconds.append(time.perf_counter() - begin)
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-coarse-reduced"))
    parser.add_argument("--calls", type=int, default=2000, help="calls a turn")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()

    library = Path(lib._name)
    about = machine()
    runtime = os.environ.get("ORT_DYLIB_PATH") or str(packaged_onnxruntime())
    with tempfile.TemporaryDirectory() as scratch:
        program = str(Path(scratch) / "overhead")
        source = str(Path(__file__).with_suffix(".c"))
        subprocess.run(["cc", "-O2", "-I", str(ROOT / "include"), source, str(library), "-o", program], check=True)
        (Path(scratch) / "libupt.so.0").symlink_to(library)
        environment = os.environ | {"LD_LIBRARY_PATH": scratch}
        lines = []
        for kind in ("nodes", "tool"):
            c, python = [], []
            for _ in range(arguments.turns):
                command = [program, arguments.bundle, str(arguments.calls), runtime, kind]
                ran = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
                c.append(statistics.median(map(float, ran.stdout.split())))
                python.append(statistics.median(in_python(arguments.bundle, arguments.calls, kind == "tool")))
            added = [1e6 * (slow - fast) for slow, fast in zip(python, c, strict=True)]
            lines.append(
                f"| {'`step_contacts`' if kind == 'nodes' else '`step_instruments`'} | "
                f"{1e6 * statistics.median(c):.0f} | {1e6 * statistics.median(python):.0f} | "
                f"{statistics.median(added):.1f} ({min(added):.1f} to {max(added):.1f}) |"
            )
    head = [
        f"`{Path(arguments.bundle).name}`, {arguments.turns} turns of {arguments.calls} calls. {about}.",
        "",
        "| call | in C, µs | in Python, µs | Python adds, µs: median (least to most of the turns) |",
        "|---|---:|---:|---:|",
    ]
    write(arguments.markdown, "python/benches/overhead.py", "\n".join(head + lines))


if __name__ == "__main__":
    main()
