"""The table of what each bundle recommends, in docs/guide/accuracy.md: `bundles.py --write` writes it.

The docs stage compares it with the manifests in `onnx/`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/guide/accuracy.md"
BEGIN, END = "<!-- bundles: begin -->\n", "<!-- bundles: end -->"
HEAD = "| folder in `onnx/` | kind | nodes | boundary | corrections | target, mm | substeps | frame step, ms |"


def row(manifest: Path) -> str:
    """One bundle; 50 ms is a step of the bundle's own length."""
    bundle = json.loads(manifest.read_text(encoding="utf-8"))
    asked = bundle["corrections"]
    cells = [
        f"`{manifest.parent.name}`",
        bundle["kind"],
        f"{bundle['mesh']['nodes']:,}",
        f"`{bundle['boundary']}`",
        asked["recommended"],
        asked["target_mm"],
        asked.get("substeps", "none"),
        round(1000 * asked.get("frame_step_s", bundle["dt_s"])),
    ]
    return "| " + " | ".join(map(str, cells)) + " |"


def table() -> str:
    """All bundles that a clone holds, by name; none that was fetched beside them."""
    assets = json.loads((ROOT / "onnx/index.json").read_text(encoding="utf-8"))["assets"]
    here = sorted(ROOT.glob("onnx/*/bundle.json"))
    rows = [row(manifest) for manifest in here if manifest.parent.name not in assets]
    return "\n".join([HEAD, "|---|---|---:|---|---:|---:|---:|---:|", *rows]) + "\n"


def faults() -> list[str]:
    """Whether the page has another table than the manifests."""
    _, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    if begin and rest.partition(END)[0] == table():
        return []
    return [f"{PAGE.relative_to(ROOT)}: the table of bundles is not that of onnx/; run tests/docs/bundles.py --write"]


def write() -> None:
    """Exchange the table in the page."""
    before, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    PAGE.write_text(before + begin + table() + end + after, encoding="utf-8")


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        write()
    sys.exit("\n".join(faults()) or 0)
