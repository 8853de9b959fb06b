"""What pages say of bundles: the docs stage compares it with the manifests and certificates in `onnx/`.

`bundles.py --write` writes the table of what each bundle recommends (docs/guide/accuracy.md), and a certificate read
aloud (docs/guide/make.md). No page gives an organ of `onnx/meshes` another number of nodes than its manifest.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

from certificate import aloud

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/guide/accuracy.md"
CERTIFIED = ROOT / "docs/guide/make.md"
BEGIN, END = "<!-- bundles: begin -->\n", "<!-- bundles: end -->"
COUNT = re.compile(r"\bK = (\d[\d,]*)|\b(\d[\d,]*) nodes\b")
# As near to a bundle's number of nodes as this, another number means the same mesh.
NEAR = 0.01
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


PARTS = (
    (PAGE, BEGIN, END, table),
    (
        CERTIFIED,
        "<!-- certificate: begin -->\n",
        "<!-- certificate: end -->",
        lambda: aloud(ROOT / "onnx/liver-coarse"),
    ),
)


def wrong_counts(page: Path, known: set[int]) -> list[str]:
    """Numbers of nodes that are nearly a bundle's."""
    found = []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        for match in COUNT.finditer(line):
            count = int((match[1] or match[2]).replace(",", ""))
            near = [nodes for nodes in known if 0 < abs(count - nodes) <= NEAR * nodes]
            if near and "paper" not in line:
                found.append(f"{page.relative_to(ROOT)}:{number}: {match[0]}: the bundle has {near[0]:,} nodes")
    return found


def faults() -> list[str]:
    """Pages that say something else than manifests and certificates."""
    found = []
    for page, begin, end, make in PARTS:
        _, has, rest = page.read_text(encoding="utf-8").partition(begin)
        if not has or rest.partition(end)[0] != make():
            where = page.relative_to(ROOT)
            found.append(f"{where}: {begin.strip()} is not what onnx/ says; run tests/docs/bundles.py --write")
    manifests = (json.loads(path.read_text(encoding="utf-8")) for path in ROOT.glob("onnx/*/bundle.json"))
    known = {manifest["mesh"]["nodes"] for manifest in manifests}
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return found + [fault for page in pages for fault in wrong_counts(page, known)]


def write() -> None:
    """Exchange the parts of the pages."""
    for page, begin, end, make in PARTS:
        before, has, rest = page.read_text(encoding="utf-8").partition(begin)
        page.write_text(before + has + make() + end + rest.partition(end)[2], encoding="utf-8")


if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        write()
    sys.exit("\n".join(faults()) or 0)
