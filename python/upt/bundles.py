"""Bundles by name: the organ in this package, those of a clone, and those that were downloaded."""

from __future__ import annotations

import json
import os
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

#: What the wheel holds: one organ, and the hashes of those that `upt.download` fetches.
ORGANS = Path(__file__).resolve().parent / "organs"


def bundle(name: str) -> Path:
    """The folder of a bundle, from wherever it is asked: `upt.Model(upt.bundle("liver-coarse"))`.

    `liver-coarse` is in the package. Others are too large for it: they are in the clone of libupt that the package was
    installed from, or where `upt.download` has put them.

    Raises:
        FileNotFoundError: there is no such bundle here; the message names those that are.
    """
    roots = [ORGANS, *(root / "onnx" for root in _clones()), downloads()]
    for root in roots:
        if (root / name / "bundle.json").is_file():
            return root / name
    known = sorted({path.parent.name for root in roots for path in root.glob("*/bundle.json")})
    here = f"there are {', '.join(known)}" if known else "there is none"
    raise FileNotFoundError(
        f"no bundle here is called {name!r}; {here}. Give upt.Model the path of a bundle's folder, or see upt.download"
    )


def downloads() -> Path:
    """Where downloaded bundles lie: `upt/bundles` in the user's cache folder, as the command `upt` has it."""
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(home) if home else Path.home() / ".cache") / "upt" / "bundles"


def _clones() -> list[Path]:
    """Where the package came from: pip keeps that; a package that is used in place lies there."""
    found = [Path(__file__).resolve().parents[2]]
    try:
        kept = distribution("libupt").read_text("direct_url.json")
    except PackageNotFoundError:
        kept = None
    if kept:
        url = urlsplit(json.loads(kept).get("url", ""))
        if url.scheme == "file":
            found.insert(0, Path(url2pathname(url.path)).parent)
    return found
