"""Schemes and programmes of tools: the table of `crates/tissue`, which writes `loads.json` (units are in the names).

`cargo run --release -p tissue --example load_tables` writes the file, and a test of that crate fails when it is stale.
"""

from __future__ import annotations

import json
from pathlib import Path

TABLES = json.loads(Path(__file__).with_name("loads.json").read_text(encoding="utf-8"))
SCHEMES: dict[str, dict] = {row["name"]: row for row in TABLES["schemes"]}


def named(**fields) -> tuple[str, ...]:
    """Names of the schemes whose rows hold these values."""
    return tuple(name for name, row in SCHEMES.items() if all(row[key] == value for key, value in fields.items()))


TRAINED = named(group="trained")
(WITHHELD,) = named(group="withheld")
STATIC = named(group="static")
TOOL = "tool-"  # what the scheme of a programme of tools begins with
TWO_INSTRUMENTS = named(instruments=2)
# Their tissue has another damping than the one that bundles are made for.
OTHER_DAMPING = tuple(name for name, row in SCHEMES.items() if row["damping"] != 1.0)
