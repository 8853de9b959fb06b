"""A body that changes: cuts, removal, stiffness, and its surface."""

from __future__ import annotations

from ctypes import byref, c_uint64
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upt import _native
from upt._arrays import Floats, Indices, address, floats, indices, number, output
from upt._library import check, lib
from upt._native import Cut
from upt.instrument import Instrument


@dataclass(frozen=True, slots=True)
class Surface:
    """The closed surface of a scene's body, and what of it is new since the surface before."""

    rest: Floats
    """`[v, 3]`, mm: where each vertex lies in the tissue at rest, for textures. The first are the mesh's nodes, also
    those that no triangle has."""
    triangles: Indices
    """`[t, 3]` vertices, outward; 0, 0, 0 in slots that are empty."""
    inside: NDArray[np.bool_]
    """`[t]`: the triangle was inside of the intact body."""
    changed: Indices
    """Slots of triangles whose corners have changed, ascending."""
    first_vertex: int
    """Vertices from this one on are new. The others keep their numbers and places."""
    is_new: bool
    """Every vertex and triangle is new: the first surface, and the first after another body was put back."""


@dataclass(frozen=True, slots=True)
class Blade:
    """A blade that feels the tissue that it cuts."""

    fracture_energy: float = 0.0
    """What new area takes, J/m²."""
    threshold: float = 0.0
    """With how much it must be pushed before a stroke begins to cut, mN, ..."""
    pushed: float = 0.0
    """... and is, mN."""
    ahead: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the edge is sharp; zeros: everywhere."""

    def record(self) -> _native.Blade:
        """As the C struct."""
        record = _native.Blade()
        record.fracture_energy = number(self.fracture_energy, "fracture_energy")
        record.threshold = number(self.threshold, "threshold")
        record.pushed = number(self.pushed, "pushed")
        x, y, z = self.ahead
        record.ahead = (number(x, "ahead"), number(y, "ahead"), number(z, "ahead"))
        return record


class Cuts:
    """Operations that change the body of a scene: `Scene` has them. docs/guide/cutting.md tells what they do.

    A cut scene has more nodes (`Scene.node_count`); those that there were keep their numbers. It steps with instruments
    or free; `restore` of an earlier snapshot is undo, and `reset` gives the intact body back.
    """

    _handle: int | None
    _vertex_count: int = 0

    def cut(self, poses: ArrayLike, stroke: int = 0, blade: Blade | None = None) -> Cut:
        """Cuts along the way of a blade's edge through the tissue as it is now. Nothing moves before the next step.

        Args:
            poses: `[poses, points, 3]`, mm: the edge as a line of points, two or more, at two poses or more.
            stroke: calls with the same number are one blade that goes on; another number cuts anew.
            blade: feels the tissue (`Cut.force`), and is felt; may refuse to cut, with an area of 0.

        Raises:
            upt.ArgumentError: the blade sweeps no area, or the body would have more copies than nodes.
            upt.UnsupportedError: the scene makes no corrections.
        """
        path = floats(poses, "poses")
        if path.ndim != 3 or path.shape[2] != 3:
            raise ValueError(f"poses has shape {path.shape}, expected (poses, points, 3)")
        out = Cut()
        record = None if blade is None else byref(blade.record())
        check(lib.upt_scene_cut_with(self._handle, record, stroke, address(path), len(path), path.shape[1], byref(out)))
        self._fit()
        return out

    def remove(self, instrument: Instrument, most_mm3: float) -> Cut:
        """Removes what lies inside of an instrument, the deepest first, up to `most_mm3`: an aspirator."""
        out = Cut()
        record = instrument.record()
        check(lib.upt_scene_remove(self._handle, byref(record), number(most_mm3, "most_mm3"), byref(out)))
        self._fit()
        return out

    def tear(self, stretch: float, most: int = 16, stroke: int = 0) -> Cut:
        """Parts tissue that is longer than `stretch` times its length at rest, across that direction as a blade would.

        Call it before each step: a tear grows from step to step, and `Cut.area_mm2` says what it has laid open.

        Args:
            stretch: the largest principal stretch that the tissue bears, above 1.
            most: elements at most whose stretch starts a tear in this call; those that it touches part with them.
            stroke: calls with the same number are one tear that goes on.

        Raises:
            upt.ArgumentError: the stretch is not above 1, or the body would have more copies than nodes.
            upt.UnsupportedError: the scene makes no corrections.
        """
        out = Cut()
        check(lib.upt_scene_tear(self._handle, stroke, number(stretch, "stretch"), most, byref(out)))
        self._fit()
        return out

    def scale_stiffness(self, elements: ArrayLike, factor: float) -> Cut:
        """Multiplies the stiffness of elements, rows of `Model.tets`: coagulation, oedema, softening."""
        chosen = indices(elements, "elements")
        out = Cut()
        factor = number(factor, "factor")
        check(lib.upt_scene_scale_stiffness(self._handle, address(chosen), len(chosen), factor, byref(out)))
        self._fit()
        return out

    def drop_fragments(self) -> Cut:
        """Takes the pieces that nothing holds out of the body: how many, and their volume."""
        out = Cut()
        check(lib.upt_scene_drop_fragments(self._handle, byref(out)))
        self._fit()
        return out

    def surface(self) -> Surface:
        """The closed surface of the body as it is now, and what has changed since the last call."""
        now = _native.Surface()
        check(lib.upt_scene_update_surface(self._handle, byref(now)))
        rest = np.empty((now.vertex_count, 3), np.float32)
        triangles = np.empty((now.triangle_count, 3), np.uint32)
        inside = np.empty(now.triangle_count, np.bool_)
        changed = np.empty(now.changed_count, np.uint32)
        places = (
            address(rest),
            len(rest),
            address(triangles),
            address(inside),
            len(inside),
            address(changed),
            len(changed),
        )
        check(lib.upt_scene_read_surface(self._handle, *places))
        self._vertex_count = len(rest)
        return Surface(rest, triangles, inside, changed, now.first_vertex, bool(now.is_new))

    def surface_positions(self, out: Floats | None = None) -> Floats:
        """Where the vertices of the last `surface` are in the last state: `[v, 3]`, mm.

        Raises:
            upt.StateError: the body has changed since; ask for its `surface` first.
        """
        places = output(out, self._vertex_count)
        check(lib.upt_scene_read_surface_positions(self._handle, address(places), places.size))
        return places

    def _fit(self) -> None:
        """The scene may have other nodes now."""
        count = c_uint64()
        check(lib.upt_scene_read_node_count(self._handle, byref(count)))
        self._resize(count.value)

    def _resize(self, node_count: int) -> None:
        raise NotImplementedError
