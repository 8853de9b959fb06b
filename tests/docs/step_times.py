"""The table "How long is a step?" of docs/results/speed.md, from the tables that measured it, and README's row."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

# A cell of a table of results: data, number of the table, what stands in its row, column.
Cell = tuple[str, int, tuple[str, ...], str] | None
TOOLS = "[all programmes](data/tools-times.json)"
RIVALS = "[rivals](accuracy.md#rivals)"
WEB = "[the web](#webassembly)"
VIEW = "[the browser](#upt-view)"
EFFORTS = ("0", "3", "10@0.02")
SETTINGS = ("k = 0", "k = 3", "as recommended")
NATIVE, MODULE = "native, ms: median, 99 %", "WebAssembly, ms"


def tools(number: int) -> list[Cell]:
    """All programmes of tools."""
    return [("tools-times", number, ("contact solved", k), "ms a step") for k in EFFORTS]


def rivals(number: int) -> list[Cell]:
    """One press."""
    return [("rivals", number, ("libupt", setting), "ms") for setting in SETTINGS]


def three(bundle: str, column: str) -> list[Cell]:
    """Three corrections, natively or in a browser."""
    return [None, ("web", 1, (bundle,), column), None]


ROWS: tuple[tuple[str, str, str, list[Cell], str], ...] = (
    ("Xeon, 1 thread", "coarse brain", "3,152", tools(1), TOOLS),
    ("Xeon, 1 thread", "brain", "21,708", tools(2), TOOLS),
    ("AMD EPYC, 1 thread", "coarse brain, one press", "3,152", rivals(1), RIVALS),
    ("AMD EPYC, 1 thread", "brain, one press", "21,708", rivals(5), RIVALS),
    ("AMD EPYC, 1 thread, steps of 20 ms", "liver", "1,178", three("liver-coarse", NATIVE), WEB),
    ("AMD EPYC, 1 thread, steps of 20 ms", "brain (`brain-supported`)", "21,708", three("supported", NATIVE), WEB),
    ("the same in WebAssembly", "liver", "1,178", three("liver-coarse", MODULE), WEB),
    ("the same in WebAssembly", "brain (`brain-supported`)", "21,708", three("supported", MODULE), WEB),
    (
        "Xeon, 2 cores that also draw the page",
        "brain, steps of 20 ms",
        "21,708",
        [None, None, ("view", 1, ("step meanwhile, ms",), "median")],
        VIEW,
    ),
)
HEAD = "| machine | organ | nodes | none | three | as recommended | source |\n|---|---|---:|---:|---:|---:|---|\n"
PROMISE = re.compile(r"([\d.]+) ms with 3,152 nodes and ([\d.]+) ms with 21,708")


def shown(cell: Cell, read: Callable[[str], list[dict]]) -> str:
    """Milliseconds; nothing where nothing was measured."""
    if cell is None:
        return ""
    name, number, words, column = cell
    table = [table for block in read(name) for table in block["tables"]][number - 1]
    rows = [row for row in table["rows"] if all(any(word in value for value in row[:2]) for word in words)]
    value = rows[0][table["columns"].index(column)]
    median = float(value.split(",")[0])
    return f"{median:.1f}" if median >= 1 else f"{median:.2g}"


def table(read: Callable[[str], list[dict]]) -> str:
    """The table's lines."""
    lines = []
    for machine, organ, nodes, cells, source in ROWS:
        figures = " | ".join(shown(cell, read) for cell in cells)
        lines.append(f"| {machine} | {organ} | {nodes} | {figures} | {source} |\n")
    return HEAD + "".join(lines)


def faults(readme: Path, read: Callable[[str], list[dict]]) -> list[str]:
    """Whether README promises other times."""
    measured = tuple(shown(row[3][2], read) for row in ROWS[:2])
    found = PROMISE.search(readme.read_text(encoding="utf-8"))
    if found and found.groups() == measured:
        return []
    return [f"README.md: a step takes {' and '.join(measured)} ms as recommended (docs/results/speed.md)"]
