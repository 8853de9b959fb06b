"""Writes the rows of all nodes into a page: `table.py ROWS.jsonl... PAGE`, between the marks `gpu rows`.

Rows of `gpu-measure` (a JSON object a line) and of `torch_rows.py` (one object with `rows`).
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "training"))

from upt_training.page import write_table  # noqa: E402

HEAD = ["| bundle | K | way | path | scenes | p50, ms | p95, ms | p99, ms | largest deviation from the CPU, relative |"]


def main(*paths: str) -> None:
    *files, page = paths
    found = [json.loads(line) for file in files for line in Path(file).read_text().splitlines()]
    found = [row for part in found for row in part.get("rows", [part])]
    lines = [*HEAD, "|---|---|---|---|---|---|---|---|---|"]
    for row in found:
        if "not_measured" in row or row.get("nodes", "all") != "all":
            continue
        deviation = row.get("deviation_from_cpu_f32")
        cells = [
            f"`{row['bundle']}`",
            f"{row['node_count']:,}",
            row["variant"],
            row.get("step_path", "-"),
            str(row["scenes"]),
            *(f"{row[name]:.2f}" for name in ("p50_ms", "p95_ms", "p99_ms")),
            "-" if deviation is None else f"{deviation:.0e}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    write_table(Path(page), "gpu rows", lines)


if __name__ == "__main__":
    main(*sys.argv[1:])
