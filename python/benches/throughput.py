"""Steps a second of `BatchedScenes` against one scene times the number of cores, by turns.

By the clock it is true only where nothing else runs; processor time says what the batch itself costs more. As many
threads as cores that step their scenes without waiting for one another say what the machine gives: cores share caches,
memory and the clock's power.

    python python/benches/throughput.py --bundle onnx/brain-reduced --scenes 8 --markdown PAGE
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import upt
from page import machine, write
from upt.batch import core_count

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-reduced"))
    parser.add_argument("--scenes", type=int, default=8)
    parser.add_argument("--steps", type=int, default=60, help="steps of each scene a turn")
    parser.add_argument("--turns", type=int, default=9)
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()

    about = machine()
    model = upt.Model(arguments.bundle)
    batch = upt.BatchedScenes(model, arguments.scenes, sleep=False)
    domain = model.domain_nodes
    contacts = [(domain[i : i + 4], np.tile(np.float32([0, 0, -2]), (4, 1))) for i in range(arguments.scenes)]
    out = np.empty((arguments.scenes, model.node_count, 3), np.float32)

    def timed(run: Callable[[], None]) -> tuple[float, float]:
        """Steps a second of wall time and of processor time."""
        wall, processor = time.perf_counter(), time.process_time()
        run()
        count = arguments.steps * arguments.scenes
        return count / (time.perf_counter() - wall), count / (time.process_time() - processor)

    def one_by_one() -> None:
        for _ in range(arguments.steps):
            for scene, (nodes, vectors), row in zip(batch.scenes, contacts, out, strict=True):
                scene.step(contacts=(nodes, vectors), out=row)

    def together() -> None:
        for _ in range(arguments.steps):
            batch.step(contacts=contacts, out=out)

    cores = core_count()

    def row(first: int) -> None:
        mine = list(zip(batch.scenes, contacts, out, strict=True))[first::cores]
        for _ in range(arguments.steps):
            for scene, (nodes, vectors), place in mine:
                scene.step(contacts=(nodes, vectors), out=place)

    threads = ThreadPoolExecutor(cores)

    def apart() -> None:
        list(threads.map(row, range(cores)))

    for warm_up in (one_by_one, together, apart):
        warm_up()
    turns = [(timed(one_by_one), timed(together), timed(apart)) for _ in range(arguments.turns)]
    single, both = (statistics.median(turn[i][0] for turn in turns) for i in range(2))
    wall, free = (statistics.median(turn[i][0] / (cores * turn[0][0]) for turn in turns) for i in (1, 2))
    processor = statistics.median(b[1] / s[1] for s, b, _ in turns)
    text = (
        f"One scene of `{Path(arguments.bundle).name}` {single:.0f} steps/s, {arguments.scenes} scenes on {cores} "
        f"cores {both:.0f} steps/s: {wall:.2f} times cores times one scene by the clock, {processor:.2f} by processor "
        f"time. {cores} threads that never wait for one another: {free:.2f} (medians of {arguments.turns} turns). "
        f"{about}."
    )
    write(arguments.markdown, "python/benches/throughput.py", text)


if __name__ == "__main__":
    main()
