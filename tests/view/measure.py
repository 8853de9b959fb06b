"""What the page of `upt view` reaches in headless Chromium: pictures a second, mouse to picture, the step meanwhile.

    python3 tests/view/measure.py --bundle onnx/brain-reduced --markdown PAGE

The mouse presses the middle of the organ and strokes to and fro, with an event every 8 ms as most mice send them; each
counts. A picture is there when its last pixel is drawn (`whenDrawn` of drawing.js); the event's own time counts.
Without a graphics card Chromium draws by the processor, so that page, library and drawing share the same cores.
`--markdown` writes the table between the marks.
"""

from __future__ import annotations

import argparse
import datetime
import math
import os
import statistics
import time
from itertools import pairwise
from pathlib import Path

from client import Browser
from running import server

ROOT = Path(__file__).resolve().parents[2]
MARK = "tests/view/measure.py"
EVENT_S = 0.008  # from one event of the mouse to the next
SPEED = 250.0  # of the mouse, pixels a second
# What the page counts: pictures, those with a new frame, steps; and a number a picture or event.
COUNTS = ["drawn", "shown", "steps"]
LISTS = ["latency", "intervals", "made", "stepTimes", "forces"]
# Where the stroke turns, from the middle of the organ.
CORNERS = [(4, 0), (25, 10), (40, 0), (15, -10), (-15, 0)]


def machine() -> str:
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    cores, load = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    return f"{names[0] if names else 'unknown processor'} ({cores} cores, load {load:.0f})"


def processor_seconds(root: int) -> dict[str, float]:
    """Processor time so far of a process and all below it: drawing (the GPU process) and the rest."""
    parents, spent, draws = {}, {}, set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            command = (folder / "cmdline").read_bytes()
        except OSError:
            continue  # ended meanwhile
        number = int(folder.name)
        parents[number] = int(fields[1])
        spent[number] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        if b"--type=gpu-process" in command:
            draws.add(number)
    found = {"drawing": 0.0, "rest": 0.0}
    for number, seconds in spent.items():
        above = number
        while above and above != root:
            above = parents.get(above, 0)
        if above:
            found["drawing" if number in draws else "rest"] += seconds
    return found


def way(seconds: float) -> tuple[float, float]:
    """Where the mouse is after so many seconds, from the middle of the organ."""
    corners = [*CORNERS, CORNERS[0]]
    lengths = [math.dist(a, b) for a, b in pairwise(corners)]
    left = (SPEED * seconds) % sum(lengths)
    for (a, b), length in zip(pairwise(corners), lengths, strict=True):
        if left <= length:
            return tuple(p + left / length * (q - p) for p, q in zip(a, b, strict=True))
        left -= length
    return corners[0]


def stroke(browser: Browser, seconds: float) -> dict:
    """Drags for so long and returns what the page counted meanwhile."""
    x, y = browser.run("return uptView.middle")
    mouse = browser.mouse()
    mouse.event("mousePressed", x + CORNERS[0][0], y + CORNERS[0][1])
    browser.wait("uptView.contacts > 0")
    browser.run(f"uptView.finish = true; for (const list of {LISTS}) uptView[list].length = 0")
    browser.run("uptView.begun = {...uptView, ms: performance.now()}")
    own = [processor_seconds(browser.driver.pid), processor_seconds(os.getpid())]
    begun = time.monotonic()
    for count in range(1, int(seconds / EVENT_S) + 1):
        time.sleep(max(begun + count * EVENT_S - time.monotonic(), 0.0))
        px, py = way(time.monotonic() - begun)
        mouse.event("mouseMoved", x + px, y + py)
    counts = ", ".join(f"{name}: uptView.{name} - {name}" for name in COUNTS)
    lists = ", ".join(f"{name}: uptView.{name}" for name in LISTS)
    found = browser.run(
        f"const {{ms, {', '.join(COUNTS)}}} = uptView.begun; return {{ms: performance.now() - ms, {counts}, {lists}}}"
    )
    used = [processor_seconds(browser.driver.pid), processor_seconds(os.getpid())]
    mouse.event("mouseReleased", x + px, y + py, held=False)
    mouse.close()
    drawing = used[0]["drawing"] - own[0]["drawing"]
    page = used[0]["rest"] - own[0]["rest"]
    server = used[1]["rest"] - own[1]["rest"] - page  # and this program, which is little
    each = [1000 * seconds / found["drawn"] for seconds in (drawing, page, server)]
    return found | {"processor": each}


def percentile(values: list[float], part: float) -> float:
    return sorted(values)[min(int(part * len(values)), len(values) - 1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", type=Path, default=ROOT / "onnx/brain-reduced")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--width", type=int, default=1000)
    parser.add_argument("--height", type=int, default=700)
    parser.add_argument("--step-ms", type=float, help="of upt view; default: what the bundle recommends for frames")
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()
    browser = Browser(arguments.width, arguments.height)
    try:
        more = () if arguments.step_ms is None else ("--step-ms", str(arguments.step_ms))
        with server(arguments.bundle, *more) as (port, token):
            browser.open(f"http://127.0.0.1:{port}/?token={token}")
            browser.wait("window.uptView && uptView.shown > 10")
            nodes, step_ms, *size = browser.run("return [uptView.nodes(), uptView.dt(), innerWidth, innerHeight]")
            stroke(browser, 2.0)  # until everything is compiled
            found = stroke(browser, arguments.seconds)
    finally:
        browser.close()
    drawn, rate = (1000 * found[name] / found["ms"] for name in ("drawn", "shown"))
    middle = statistics.median
    size = "a page of {} x {} pixels".format(*size)
    steps = f"{found['steps']} steps of {step_ms:.0f} ms"
    drag = f"{found['ms'] / 1000:.0f} s of strokes ({steps}, median force {middle(found['forces']):.0f} mN)"

    def row(what: str, values: list[float], digits: int = 1) -> str:
        return f"| {what} | {middle(values):.{digits}f} | {percentile(values, 0.99):.{digits}f} |"

    lines = [
        f"`{arguments.bundle.name}`, {nodes} nodes, {size}, {drag}. {machine()}, {datetime.date.today()}.",
        "",
        "| | median | 99 % |",
        "|---|---:|---:|",
        f"| pictures a second (mean) | {drawn:.1f} | |",
        f"| of these with the tissue of their own moment | {rate:.1f} | |",
        row("from picture to picture, ms", found["intervals"]),
        row(f"mouse to picture, ms ({len(found['latency'])} events)", found["latency"]),
        row("making the tissue of a picture's moment, ms", found["made"], 2),
        row("step meanwhile, ms", found["stepTimes"]),
        "",
        "Processor time a picture: drawing {:.1f} ms, page {:.1f} ms, library {:.1f} ms.".format(*found["processor"]),
    ]
    text = "\n".join(lines)
    print(text)
    if arguments.markdown:
        page = arguments.markdown.read_text()
        begin, end = f"<!-- begin: {MARK} -->", f"<!-- end: {MARK} -->"
        head, rest = page.split(begin, 1)
        arguments.markdown.write_text(head + begin + "\n" + text + "\n\n" + end + rest.split(end, 1)[1])


if __name__ == "__main__":
    main()
