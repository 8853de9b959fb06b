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

#: The end of `upt_input`: forces, pressures, ties, supports and forces at points, how many of each, gravity and that at
#: rest, the pose.
_LAYOUT = Struct("@PPQPQPQPQ13f")
OFFSET: int = _native.Input.forces.offset  # type: ignore[union-attr]


@dataclass(frozen=True, slots=True)
class Support:
    """What a support group of the bundle does at the end of a step, an element of `Loads.supports`."""

    group: int
    """Its place among `Model.supports`."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """As a rigid body in the mesh's frame: a node `x` of the group ends at `R x + position`, mm."""
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """`R` as a unit quaternion x, y, z, w."""
    let_go: bool = False
    """It holds nothing. Held again, it holds its nodes where they are then."""
    displacements: ArrayLike | None = None
    """Instead of a pose: `[n, 3]`, mm, of each of its nodes."""

    def record(self, name: str) -> tuple[_native.Support, object]:
        """The struct, and what must live with it."""
        own = None if self.displacements is None else np.ascontiguousarray(self.displacements, np.float32)
        record = _native.Support(
            group=self.group,
            position=tuple(number(value, f"{name}.position") for value in self.position),
            rotation=tuple(number(value, f"{name}.rotation") for value in self.rotation),
            let_go=int(self.let_go),
        )
        if own is not None:
            record.position, record.rotation = (0.0,) * 3, (0.0,) * 4
            record.displacements, record.displacement_count = address(own), own.size
        return record, own


@dataclass(frozen=True, slots=True)
class PointForce:
    """A force at a point of the tissue, an element of `Loads.point_forces`."""

    nodes: Sequence[int]
    """Four nodes around the point, `Model.locate` finds them, or one."""
    force: tuple[float, float, float]
    """mN, in the mesh's frame."""
    weights: Sequence[float] = ()
    """Those of the four nodes, 0 or more, with the sum 1; empty: the first node alone."""

    def record(self, name: str) -> _native.PointForce:
        """The struct."""
        nodes, weights = [int(node) for node in self.nodes], [float(weight) for weight in self.weights]
        if len(nodes) not in (1, 4) or len(weights) not in (0, 4):
            raise ValueError(
                f"{name} has {len(nodes)} nodes and {len(weights)} weights, must have four of each, or one node"
            )
        return _native.PointForce(
            nodes=tuple(nodes * 4 if len(nodes) == 1 else nodes),
            weights=tuple(weights or [0.0] * 4),
            force=tuple(number(value, f"{name}.force") for value in self.force),
        )


@dataclass(frozen=True, slots=True)
class Loads:
    """Loads at the end of a step; within the step they change on a line from those of the last.

    They act in scenes with corrections, beside whatever drives the step. What acts of gravity is
    `gravity - gravity_at_rest`.
    """

    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the mesh's frame, m/s²."""
    gravity_at_rest: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """That under which the mesh was scanned, m/s²; zeros: the bundle's."""
    forces: ArrayLike | None = None
    """`[K, 3]`, mN, on the nodes."""
    point_forces: Sequence[PointForce] = ()
    """Forces at points of the tissue, at most 256, beside those on nodes."""
    pressures: Sequence[tuple[ArrayLike | None, float]] = ()
    """Pairs of nodes and a pressure from outside, Pa, which follows the surface.

    It acts on the boundary triangles with all corners among the nodes; None: on the domain."""

    support: tuple[tuple[float, float, float], tuple[float, float, float, float]] | None = None
    """Where what holds the body is: position (mm) and unit quaternion x, y, z, w; in every step, where it moves.

    All else stays in the mesh's frame, which goes with the support, but gravity, which is the world's then."""

    ties: Sequence[Tie] = ()
    """Ties of the tissue, at most 256, beside instruments or alone; in every step, in the same order."""

    supports: Sequence[Support] = ()
    """What support groups of the bundle do, in every step; one that is not named is held."""

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
        groups = [support.record(f"supports[{index}]") for index, support in enumerate(self.supports)]
        led = (_native.Support * len(groups))(*(record for record, _ in groups))
        led_at = addressof(led) if groups else 0
        points = [force.record(f"point_forces[{index}]") for index, force in enumerate(self.point_forces)]
        pushing = (_native.PointForce * len(points))(*points)
        pushing_at = addressof(pushing) if points else 0
        at, tied_at = addressof(array) if records else 0, addressof(tied) if ties else 0
        pushed = 0 if forces is None else address(forces)
        counted = (pushed, at, len(records), tied_at, len(ties), led_at, len(groups), pushing_at, len(points))
        _LAYOUT.pack_into(memory, OFFSET, *counted, *gravity)
        return forces, regions, array, tied, groups, led, pushing
