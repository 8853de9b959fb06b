"""The time from `pip install` of the wheel to the first step, in an empty folder that holds nothing but the wheel.

A fresh environment each turn, made before the clock runs; what libupt needs besides (NumPy, ONNX Runtime) comes from
pip's index, or from its cache where it was fetched before. The step is that of the first lines: a contact on the liver
that the wheel holds.

    python python/benches/first_step.py target/package/libupt-*.whl --markdown PAGE
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

from page import machine, write

FIRST = """
import upt

scene = upt.Model(upt.bundle("liver-coarse")).scene()
u = scene.step(contacts=([17, 18], [[0, 0, -4], [0, 0, -4]]))
assert u.shape == (1178, 3) and abs(u).max() > 3, u
"""
#: What would find libupt elsewhere.
OURS = ("UPT_LIBRARY", "UPT_MIRROR", "ORT_DYLIB_PATH", "PYTHONPATH")


def turn(wheel: Path) -> tuple[float, float]:
    """Seconds of `pip install`, and of the first program."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        venv.create(folder / "env", with_pip=True)
        empty = folder / "empty"
        empty.mkdir()
        shutil.copy(wheel, empty)
        python = folder / "env" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        clean = {key: value for key, value in os.environ.items() if key not in OURS}
        times = []
        for words in (["-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel.name], ["-c", FIRST]):
            start = time.perf_counter()
            subprocess.run([python, *words], cwd=empty, env=clean, check=True)
            times.append(time.perf_counter() - start)
        return times[0], times[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()
    about = machine()
    before = os.times()
    turns = [turn(arguments.wheel.resolve()) for _ in range(arguments.turns)]
    after = os.times()
    processor = (after.children_user + after.children_system - before.children_user - before.children_system) / len(
        turns
    )
    both = [sum(one) for one in turns]
    install, program = (statistics.median(one[i] for one in turns) for i in (0, 1))
    text = (
        f"From `pip install` of the wheel to the first step, in an empty folder: {statistics.median(both):.1f} s "
        f"({min(both):.1f} to {max(both):.1f}). `pip install` with all that the wheel needs takes {install:.1f} s of "
        f"them, the first program {program:.1f} s; of processor time, the environment included, {processor:.1f} s "
        f"(medians of {len(turns)} turns; Python {sys.version_info.major}.{sys.version_info.minor}). {about}."
    )
    write(arguments.markdown, "python/benches/first_step.py", text)


if __name__ == "__main__":
    main()
