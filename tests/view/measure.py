"""What the page of `upt view` reaches in headless Chromium: pictures a second, mouse to picture, the step meanwhile.

    python3 tests/view/measure.py --bundle onnx/brain-reduced --markdown docs/guide/view.md

The mouse presses the middle of the page and strokes to and fro, by chromedriver. A picture counts when its last pixel
is drawn (`readPixels` waits for it); the mouse's time is the event's own. Without a graphics card Chromium draws by the
processor, so that page, library and drawing share the same cores. `--markdown` writes the table between the marks.
"""

from __future__ import annotations

import argparse
import datetime
import os
import statistics
from itertools import pairwise
from pathlib import Path

from client import Browser
from run import server

ROOT = Path(__file__).resolve().parents[2]
MARK = "tests/view/measure.py"
# Moves of the mouse from one corner of the stroke to the next.
SLICES = 6


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


def stroke(browser: Browser, seconds: float) -> dict:
    """Drags for so long and returns what the page counted meanwhile."""
    width, height = browser.run("return [innerWidth, innerHeight]")
    x, y = width // 2, height // 2
    browser.drag([(x, y), (x + 4, y)], release=False)
    browser.wait("uptView.contacts > 0")
    browser.run("uptView.finish = true; for (const list of ['latency', 'intervals', 'made']) uptView[list].length = 0")
    browser.run("uptView.begun = performance.now(); uptView.before = uptView.shown; uptView.steps0 = uptView.steps")
    steps, forces = [], []
    own = [processor_seconds(browser.driver.pid), processor_seconds(os.getpid())]
    # As a hand moves a mouse: about 250 pixels a second, an event every 16 ms.
    corners = [(4, 0), (25, 10), (40, 0), (15, -10), (-15, 0), (4, 0)]
    way = [
        (round(x + (1 - part) * ax + part * bx), round(y + (1 - part) * ay + part * by))
        for (ax, ay), (bx, by) in pairwise(corners)
        for part in [step / SLICES for step in range(1, SLICES + 1)]
    ]
    while browser.run("return performance.now() - uptView.begun") < 1000 * seconds:
        browser.move(way, 16)
        now = browser.run("return [uptView.stepMs, uptView.force]")
        steps.append(now[0])
        forces.append(now[1])
    found = browser.run(
        "return {pictures: uptView.shown - uptView.before, ms: performance.now() - uptView.begun, "
        "latency: uptView.latency, intervals: uptView.intervals, made: uptView.made, "
        "steps: uptView.steps - uptView.steps0}"
    )
    used = [processor_seconds(browser.driver.pid), processor_seconds(os.getpid())]
    browser.release()
    drawing = used[0]["drawing"] - own[0]["drawing"]
    page = used[0]["rest"] - own[0]["rest"]
    server = used[1]["rest"] - own[1]["rest"] - page  # and this program, which is little
    each = [1000 * seconds / found["pictures"] for seconds in (drawing, page, server)]
    return found | {"step": steps, "force": forces, "processor": each}


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
            nodes, step_ms = browser.run("return [uptView.nodes(), uptView.dt()]")
            stroke(browser, 2.0)  # until everything is compiled
            found = stroke(browser, arguments.seconds)
    finally:
        browser.close()
    rate = 1000 * found["pictures"] / found["ms"]
    middle = statistics.median
    size = f"{arguments.width} x {arguments.height} pixels"
    steps = f"{found['steps']} steps of {step_ms:.0f} ms"
    drag = f"{found['ms'] / 1000:.0f} s of strokes ({steps}, median force {middle(found['force']):.0f} mN)"

    def row(what: str, values: list[float], digits: int = 1) -> str:
        return f"| {what} | {middle(values):.{digits}f} | {percentile(values, 0.99):.{digits}f} |"

    lines = [
        f"`{arguments.bundle.name}`, {nodes} nodes, {size}, {drag}. {machine()}, {datetime.date.today()}.",
        "",
        "| | median | 99 % |",
        "|---|---:|---:|",
        f"| pictures a second (mean) | {rate:.1f} | |",
        row("from picture to picture, ms", found["intervals"]),
        row(f"mouse to picture, ms ({len(found['latency'])} moves)", found["latency"]),
        row("making the tissue of a picture's moment, ms", found["made"], 2),
        row("step meanwhile, ms", found["step"]),
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
