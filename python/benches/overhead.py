"""What Python adds to a step: the same loop in C and in Python, by turns.

    python python/benches/overhead.py --bundle onnx/brain-coarse-reduced

Prints the median seconds of a call in each, over all turns, and their difference in microseconds.
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
from upt._library import packaged_onnxruntime

ROOT = Path(__file__).resolve().parents[2]


def in_python(bundle: str, calls: int) -> list[float]:
    with upt.Model(bundle) as model, model.scene(no_sleep=True) as scene:
        nodes, vectors = model.domain_nodes[:4], np.tile(np.float32([0, 0, -1]), (4, 1))
        out, seconds = np.empty((model.node_count, 3), np.float32), []
        for _ in range(calls):
            begin = time.perf_counter()
            scene.step_contacts(nodes, vectors, out)
            seconds.append(time.perf_counter() - begin)
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-coarse-reduced"))
    parser.add_argument("--calls", type=int, default=2000, help="calls a turn")
    parser.add_argument("--turns", type=int, default=5)
    arguments = parser.parse_args()

    folder = Path(upt.__file__).parent / "lib"
    runtime = os.environ.get("ORT_DYLIB_PATH") or str(packaged_onnxruntime())
    with tempfile.TemporaryDirectory() as scratch:
        program = str(Path(scratch) / "overhead")
        source = str(Path(__file__).with_suffix(".c"))
        library = [str(folder / "libupt.so"), f"-Wl,-rpath,{folder}"]
        subprocess.run(["cc", "-O2", "-I", str(ROOT / "include"), source, *library, "-o", program], check=True)
        (Path(scratch) / "libupt.so.0").symlink_to(folder / "libupt.so")
        environment = os.environ | {"LD_LIBRARY_PATH": scratch}
        c, python = [], []
        for turn in range(arguments.turns):
            command = [program, arguments.bundle, str(arguments.calls), runtime]
            printed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout
            c.append(statistics.median(map(float, printed.split())))
            python.append(statistics.median(in_python(arguments.bundle, arguments.calls)))
            print(f"turn {turn}: C {c[-1] * 1e6:.1f} us, Python {python[-1] * 1e6:.1f} us")
    difference = 1e6 * (statistics.median(python) - statistics.median(c))
    print(f"Python adds {difference:.1f} us to a step of {statistics.median(c) * 1e6:.1f} us")


if __name__ == "__main__":
    main()
