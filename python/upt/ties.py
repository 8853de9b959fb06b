"""Ties of the tissue: springs that pull, may be slack, and break; a bed is many of them."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from upt import _native
from upt._arrays import Floats, Indices, address, number, vectors
from upt._library import check, lib


@dataclass(slots=True)
class Tie:
    """A tie: a spring between a point of the tissue and something else, an element of `Loads.ties`.

    Its place in the list is its identity: pass every tie in every step, in the same order. A broken one stays broken in
    its place until it has a stiffness of 0 there, the list ends before it, or the scene is reset.
    """

    nodes: Sequence[int]
    """The point of the tissue: one to three nodes, of which one at least is free and near the domain."""
    place: Sequence[float] = (0.0, 0.0, 0.0)
    """Where its far end is at the end of the step, mm; in the instrument's frame where it is on one."""
    stiffness: float = 0.0
    """N/m, which is mN/mm; 0: it does not pull."""
    weights: Sequence[float] = (1.0, 0.0, 0.0)
    """Of the nodes, 0 or more, with the sum 1."""
    slack: float = 0.0
    """It pulls where it is longer than this, mm."""
    damping: float = 0.0
    """N s/m."""
    break_force: float = 0.0
    """It breaks under a larger tension, mN; 0: never."""
    pushes: bool = False
    """Whether it pushes where it is shorter than its slack length, as a rod does."""
    to: str | _native.End = "support"
    """What it is tied to: support (the mesh's frame), world, instrument or tissue (a suture)."""
    instrument: int = 0
    """The instrument's place in the step's list."""
    other_nodes: Sequence[int] = (0,)
    """A suture's other point, as `nodes`."""
    other_weights: Sequence[float] = (1.0, 0.0, 0.0)
    """As `weights`."""

    def record(self, name: str) -> _native.Tie:
        """As the C struct."""
        return _native.Tie(
            to=self.to,
            nodes=_three(self.nodes, f"{name}.nodes"),
            weights=_weights(self.weights),
            place=tuple(number(value, f"{name}.place") for value in self.place),
            instrument=self.instrument,
            other_nodes=_three(self.other_nodes, f"{name}.other_nodes"),
            other_weights=_weights(self.other_weights),
            stiffness=number(self.stiffness, f"{name}.stiffness"),
            slack_mm=number(self.slack, f"{name}.slack"),
            damping=number(self.damping, f"{name}.damping"),
            break_mn=number(self.break_force, f"{name}.break_force"),
            pushes=bool(self.pushes),
        )


def _three(nodes: Sequence[int], name: str) -> tuple[int, ...]:
    given = [int(node) for node in nodes]
    if not 1 <= len(given) <= 3:
        raise ValueError(f"{name} has {len(given)} entries, must have one to three")
    return tuple(given + given[:1] * (3 - len(given)))


def _weights(weights: Sequence[float]) -> tuple[float, ...]:
    given = [float(weight) for weight in weights]
    return tuple(given + [0.0] * (3 - len(given)))


class Ties:
    """What a scene does with ties; `Scene` has it."""

    _handle: int | None
    _tie_count: int

    def tie_points(self, places: ArrayLike) -> tuple[Indices, Floats]:
        """The points of the tissue nearest to places `[n, 3]`, mm, for `Tie.nodes` and `Tie.weights`.

        On the domain, the surface that instruments may touch, where it is in the last state.

        Returns:
            Nodes `[n, 3]` and weights `[n, 3]`.
        """
        given = vectors(places, "places")
        nodes, weights = np.zeros((len(given), 3), np.uint32), np.zeros((len(given), 3), np.float32)
        if len(given):
            check(lib.upt_scene_tie_points(self._handle, address(given), len(given), address(nodes), address(weights)))
        return nodes, weights

    def bed(
        self,
        centre: Sequence[float] = (0.0, 0.0, 0.0),
        radius: float = 0.0,
        *,
        nodes: ArrayLike | None = None,
        stiffness: float,
        break_force: float = 0.0,
        damping: float = 0.0,
        slack: float = 0.0,
        offset: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> list[Tie]:
        """A bed: a tie at each free node of the domain within a region, from where the node is in the last state.

        Args:
            centre, radius: the region, mm, in the mesh's frame.
            nodes: the region as nodes instead.
            stiffness: of all ties together, N/m; they share it by the area of surface around each node, and `damping`
                (N s/m) and `break_force` (mN) as well.
            slack: of each tie, mm.
            offset: from each node to where it is tied, mm.

        Raises:
            upt.ArgumentError: no free node of the domain is in the region, or more than 256.
        """
        listed = None if nodes is None else np.ascontiguousarray(nodes, np.uint32)
        bed = _native.Bed(
            radius_mm=number(radius, "radius"),
            centre=tuple(number(value, "centre") for value in centre),
            offset=tuple(number(value, "offset") for value in offset),
            nodes=address(listed) if listed is not None and listed.size else None,
            node_count=0 if listed is None else listed.size,
            stiffness=number(stiffness, "stiffness"),
            slack_mm=number(slack, "slack"),
            damping=number(damping, "damping"),
            break_mn=number(break_force, "break_force"),
        )
        needed = ctypes.c_uint64()
        check(lib.upt_scene_bed(self._handle, ctypes.byref(bed), None, 0, ctypes.byref(needed)))
        array = (_native.Tie * needed.value)(*[_native.Tie() for _ in range(needed.value)])
        check(lib.upt_scene_bed(self._handle, ctypes.byref(bed), array, len(array), ctypes.byref(needed)))
        return [
            Tie(
                nodes=tuple(one.nodes),
                place=tuple(one.place),
                stiffness=one.stiffness,
                weights=tuple(one.weights),
                slack=one.slack_mm,
                damping=one.damping,
                break_force=one.break_mn,
                pushes=bool(one.pushes),
            )
            for one in array
        ]

    def tie_readings(self) -> list[_native.TieReading]:
        """What each tie of the last step does: force on the tissue (mN), length (mm), `broken`, `broke` (in it)."""
        found = [_native.TieReading() for _ in range(self._tie_count)]
        array = (_native.TieReading * len(found))(*found)
        check(lib.upt_scene_read_ties(self._handle, array if found else None, len(found)))
        return list(array)
