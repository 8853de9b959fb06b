"""The bundles that ship with libupt, by name."""

from __future__ import annotations

import json
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname


def bundle(name: str) -> Path:
    """The folder of a bundle that ships, from wherever it is asked: `upt.Model(upt.bundle("brain-reduced"))`.

    Bundles are too large for the package: they are in the clone of libupt that it was installed from.

    Raises:
        FileNotFoundError: there is no such bundle, or the package did not come from a clone.
    """
    roots = _clones()
    for root in roots:
        if (root / "onnx" / name / "bundle.json").is_file():
            return root / "onnx" / name
    known = sorted(path.parent.name for root in roots for path in (root / "onnx").glob("*/bundle.json"))
    if known:
        raise FileNotFoundError(f"no bundle that ships is called {name!r}; there are {', '.join(known)}")
    raise FileNotFoundError(
        f"bundle {name!r}: this package was not installed from a clone of libupt, or the clone is gone; "
        "give upt.Model the path of a bundle's folder"
    )


def _clones() -> list[Path]:
    """Where the package came from: pip keeps that; a package that is used in place lies there."""
    found = [Path(__file__).resolve().parents[2]]
    try:
        kept = distribution("upt").read_text("direct_url.json")
    except PackageNotFoundError:
        kept = None
    if kept:
        url = urlsplit(json.loads(kept).get("url", ""))
        if url.scheme == "file":
            found.insert(0, Path(url2pathname(url.path)).parent)
    return found
