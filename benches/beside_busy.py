"""Two threads beside one, on a machine that does nothing else and beside one busy core: time of a step in contact.

python benches/beside_busy.py [--bundle onnx/brain-reduced] [--rounds N]

Takes the library of this clone (`cargo build --release -p libupt`) and the poses of `in_turns.py`, each round a new
scene of either kind, in turns. Prints a row for each programme and number of corrections, without and with another
process that takes a whole core: median and 90 and 99 % of both, and two over one.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
ROOT = Path(__file__).parent.parent
if "UPT_LIBRARY" not in os.environ:
    os.environ["UPT_LIBRARY"] = str(ROOT / "target/release/libupt.so")
sys.path.insert(0, str(ROOT / "python"))

import in_turns  # noqa: E402

KINDS = [("press", 3), ("stroke", 3), ("stroke", 0)]


def main():
    import numpy as np

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-reduced"))
    parser.add_argument("--rounds", type=int, default=6)
    options = parser.parse_args()
    builds = [in_turns.Build(options.bundle, threads) for threads in (1, 2)]
    print("| programme | corrections | beside | one thread, ms: median, 90 %, 99 % | two | two over one |")
    print("|---|---|---|---|---|---|", flush=True)
    for beside in ("nothing", "a busy core"):
        busy = None
        if beside != "nothing":
            busy = subprocess.Popen([sys.executable, "-c", "while True: pass"], start_new_session=True)
        try:
            for programme, corrections in KINDS:
                took = [[], []]
                for turn in range(options.rounds + 1):
                    for times, build in zip(took, builds, strict=True):
                        new, _ = build.run(programme, corrections)
                        if turn:  # the first one warms up
                            times.extend(new)
                one, two = (np.quantile(times, [0.5, 0.9, 0.99]) for times in took)
                cells = [", ".join(f"{value:.1f}" for value in values) for values in (one, two)]
                ratio = ", ".join(f"{value:.2f}" for value in two / one)
                print(f"| {programme} | {corrections or 'recommended'} | {beside} | {' | '.join(cells)} | {ratio} |")
        finally:
            if busy:
                busy.kill()


if __name__ == "__main__":
    main()
