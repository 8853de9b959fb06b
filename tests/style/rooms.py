"""Imports between the rooms of the library (the modules of `src/`) run downward: a room knows those below it only.

ORDER is the order of the rooms, lowest first. A room that is not in it is a fault, and so is an import that runs upward
and is not in UPWARD with its reason. Ends with 1 and a line for each.
"""

from __future__ import annotations

import sys
from pathlib import Path

from structure.rust import ROOT, Crate

ORDER = """
    features options stats library graph guard onnx
    envelope forces instrument haptics replay
    model scene arrays ffi
""".split()

# (room, room above it): why. None is the goal.
UPWARD: dict[tuple[str, str], str] = {}


def main() -> int:
    """Checks the crate at the root."""
    crate = Crate(ROOT / "src")
    rooms = {module[0] for module in crate.files if module}
    faults = [f"src/{room} has no place in ORDER of {Path(__file__).name}" for room in sorted(rooms - set(ORDER))]
    faults += [f"ORDER names {room}, which is no room of src/" for room in ORDER if room not in rooms]
    place = {room: at for at, room in enumerate(ORDER)}
    arrows, used = set(), set()
    for module, targets in crate.arrows().items():
        for target, names in targets.items():
            if not module or not target or module[0] == target[0]:
                continue
            pair = (module[0], target[0])
            arrows.add(pair)
            if place.get(pair[0], 0) >= place.get(pair[1], 0):
                continue
            used.add(pair)
            if pair not in UPWARD:
                file = crate.files[module].path.relative_to(ROOT)
                faults.append(f"{file} takes `{names[0]}` from {pair[1]}, a room above {pair[0]}")
    faults += [f"UPWARD names {pair}, which is no longer there" for pair in UPWARD if pair not in used]
    print("\n".join(faults) or f"{len(rooms)} rooms, {len(arrows)} arrows between them, {len(used)} of them upward")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
