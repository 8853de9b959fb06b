"""What acts on the body beside contact: gravity, forces, pressure on the surface, a support that moves, ties."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import addressof
from dataclasses import dataclass
from struct import Struct

import numpy as np
from numpy.typing import ArrayLike

from upt import _native
from upt._arrays import address, number, vectors
from upt.ties import Tie

#: The end of `upt_input`: forces, pressures and ties, how many of each, gravity and that at rest, the support's pose.
_LAYOUT = Struct("@PPQPQ13f")
OFFSET: int = _native.Input.forces.offset  # type: ignore[union-attr]


@dataclass(frozen=True, slots=True)
class Loads:
    """Loads at the end of a step; within the step they change on a line from those of the last.

    They act in scenes with corrections, beside whatever drives the step. What acts of gravity is
    `gravity - gravity_at_rest`.
    """

    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the mesh's frame, m/s²."""
    gravity_at_rest: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """That under which the mesh was scanned, m/s²."""
    forces: ArrayLike | None = None
    """`[K, 3]`, mN, on the nodes."""
    pressures: Sequence[tuple[ArrayLike | None, float]] = ()
    """Pairs of nodes and a pressure from outside, Pa, which follows the surface.

    It acts on the boundary triangles with all corners among the nodes; None: on the domain."""

    support: tuple[tuple[float, float, float], tuple[float, float, float, float]] | None = None
    """Where what holds the body is: position (mm) and unit quaternion x, y, z, w; in every step, where it moves.

    All else stays in the mesh's frame, which goes with the support, but gravity, which is the world's then."""

    ties: Sequence[Tie] = ()
    """Ties of the tissue, at most 256, beside instruments or alone; in every step, in the same order."""

    def pack_into(self, memory: bytearray, node_count: int) -> object:
        """Puts these loads into a `upt_input`; gives what must live over the call."""
        forces = None if self.forces is None else vectors(self.forces, "forces", node_count)
        regions = [None if nodes is None else np.ascontiguousarray(nodes, np.uint32) for nodes, _ in self.pressures]
        records = [
            _native.Pressure(
                pascal=number(pascal, f"pressures[{index}]"),
                nodes=address(region) if region is not None and region.size else None,
                node_count=0 if region is None else region.size,
            )
            for index, (region, (_, pascal)) in enumerate(zip(regions, self.pressures, strict=True))
        ]
        array = (_native.Pressure * len(records))(*records)
        gravity = [number(value, "gravity") for value in (*self.gravity, *self.gravity_at_rest)]
        position, rotation = self.support or ((0.0,) * 3, (0.0,) * 4)
        gravity += [number(value, "support") for value in (*position, *rotation)]
        ties = [tie.record(f"ties[{index}]") for index, tie in enumerate(self.ties)]
        tied = (_native.Tie * len(ties))(*ties)
        at, tied_at = addressof(array) if records else 0, addressof(tied) if ties else 0
        pushed = 0 if forces is None else address(forces)
        _LAYOUT.pack_into(memory, OFFSET, pushed, at, len(records), tied_at, len(ties), *gravity)
        return forces, regions, array, tied
