"""Rigid instruments that drive a scene's steps, and tools of a shape of their own."""

from __future__ import annotations

import ctypes
import struct
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from reprlib import repr as short

import numpy as np
from numpy.typing import ArrayLike

from upt import _native
from upt._arrays import address, indices, vectors
from upt._library import check, ensure_started, lib
from upt._native import Mode, Shape


class Hull:
    """A tool of its own shape, for `Instrument.hull`. Immutable; any thread may use it.

    Args:
        points: `[n, 3]`, mm, in the tool's own frame; 4 to 100,000, with a volume.
        faces: `[m, 3]`, points of each triangle of a closed surface, whose hollows stay; none for the convex hull.

    Raises:
        upt.ArgumentError: points that are not finite, too few, too many or without a volume; a surface that is not
            closed, crosses itself, has a part inside out or a wall of less than 0.2 mm.
    """

    def __init__(self, points: ArrayLike, faces: ArrayLike | None = None) -> None:
        ensure_started()
        given = vectors(points, "points")
        sides = indices(() if faces is None else np.asarray(faces).reshape(-1), "faces")
        if len(sides) % 3 != 0:
            raise ValueError(f"faces: {len(sides)} points make no triangles; give [m, 3]")
        handle = ctypes.c_void_p()
        count = len(sides) // 3
        check(lib.upt_hull_create(address(given), len(given), address(sides), count, ctypes.byref(handle)))
        self._handle = handle.value
        self._destroy = weakref.finalize(self, lib.upt_hull_destroy, handle.value)

    def close(self) -> None:
        """Frees the hull; steps that were submitted with it still finish. Also done when the object is collected."""
        self._destroy()


@dataclass
class Instrument:
    """A rigid instrument: what drives `Scene.step`, and what `Scene.contacts` takes.

    Made by `sphere`, `capsule`, `box`, `spatula` or `hull`; move it by assigning `position` and `rotation`.
    """

    shape: Shape | str
    """`upt.Shape` or its name: sphere, capsule (along local y), box, spatula (a box with rounded corners), hull."""
    position: Sequence[float] = (0.0, 0.0, 0.0)
    """Centre at the end of the step, mm, in the mesh's frame; a hull's origin."""
    rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    """Unit quaternion x, y, z, w."""
    half_extents: Sequence[float] = (0.0, 0.0, 0.0)
    """Half sizes along the local axes, mm; a capsule's half length without its caps is `[1]`."""
    radius: float = 0.0
    """A sphere's or a capsule's radius or a spatula's corner radius, mm."""
    friction: float = 0.0
    """Coulomb's coefficient, 0 or more. Only for `step`."""
    grasp: bool = False
    """Whether it holds what was within 0.5 mm of it when this became true. Only for `step`."""
    tear_off: float = 0.0
    """A grasp tears off when the tissue pulls harder than this, mN; 0: never."""
    sticking: bool = False
    """Only for `contacts`: touched nodes move with the instrument until it leaves."""
    hull_of: Hull | None = None
    """The shape of an instrument of shape hull."""

    @classmethod
    def sphere(
        cls,
        radius: float,
        *,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        friction: float = 0.0,
        grasp: bool = False,
        tear_off: float = 0.0,
    ) -> Instrument:
        """A ball of this radius, mm."""
        return cls(Shape.SPHERE, position, radius=radius, friction=friction, grasp=grasp, tear_off=tear_off)

    @classmethod
    def capsule(
        cls,
        radius: float,
        half_length: float = 0.0,
        *,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        friction: float = 0.0,
        grasp: bool = False,
        tear_off: float = 0.0,
    ) -> Instrument:
        """A capsule along local y; `half_length` (mm, without the caps) 0 is a sphere."""
        half = (0.0, half_length, 0.0)
        return cls(Shape.CAPSULE, position, rotation, half, radius, friction, grasp, tear_off)

    @classmethod
    def box(
        cls,
        half_extents: Sequence[float],
        *,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        friction: float = 0.0,
        grasp: bool = False,
        tear_off: float = 0.0,
    ) -> Instrument:
        """A box of these half sizes, mm."""
        return cls(Shape.BOX, position, rotation, half_extents, 0.0, friction, grasp, tear_off)

    @classmethod
    def spatula(
        cls,
        half_extents: Sequence[float],
        radius: float,
        *,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        friction: float = 0.0,
        grasp: bool = False,
        tear_off: float = 0.0,
    ) -> Instrument:
        """A box of these half sizes rounded by `radius`, mm."""
        return cls(Shape.SPATULA, position, rotation, half_extents, radius, friction, grasp, tear_off)

    @classmethod
    def hull(
        cls,
        hull: Hull | ArrayLike,
        *,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        friction: float = 0.0,
        grasp: bool = False,
        tear_off: float = 0.0,
    ) -> Instrument:
        """The convex hull of points `[n, 3]`, mm, in the tool's own frame, or a `Hull`, which may have hollows."""
        made = hull if isinstance(hull, Hull) else Hull(hull)
        return cls(
            Shape.HULL,
            position,
            rotation,
            friction=friction,
            grasp=grasp,
            tear_off=tear_off,
            hull_of=made,
        )

    def _packed(self) -> bytes:
        """As `record`, in bytes. Any error means: let `record` say what is wrong."""
        x, y, z = self.position
        qx, qy, qz, qw = self.rotation
        a, b, c = self.half_extents
        mode = _GRASP if self.grasp else _SLIDE
        hull = 0 if self.hull_of is None else self.hull_of._handle
        return _pack(
            _SIZE, self.shape, x, y, z, qx, qy, qz, qw, a, b, c,
            self.radius, self.sticking, mode, self.friction, self.tear_off, hull,
        )  # fmt: skip

    def record(self) -> _native.Instrument:
        """As the C ABI's struct. It does not keep the hull alive."""
        return _native.Instrument(
            shape=self.shape,
            position=self.position,
            rotation=self.rotation,
            half_extents=self.half_extents,
            radius=self.radius,
            sticking=self.sticking,
            mode=Mode.GRASP if self.grasp else Mode.SLIDE,
            friction=self.friction,
            tear_off_mn=self.tear_off,
            hull=None if self.hull_of is None else self.hull_of._handle,
        )


#: `upt_instrument` as it lies in memory. `record` is the same by the fields' names: slower, with errors that name them.
_LAYOUT = struct.Struct("@Ii3f4f3ff?B2xffP")
_SIZE = ctypes.sizeof(_native.Instrument)
assert _LAYOUT.size == _SIZE
_pack = _LAYOUT.pack
_SLIDE, _GRASP = int(Mode.SLIDE), int(Mode.GRASP)


def records(instruments: Sequence[Instrument]) -> tuple[bytes | ctypes.Array[_native.Instrument] | None, int]:
    """As an array for the C ABI (None where there are no instruments), and its length."""
    try:
        count = len(instruments)
    except TypeError:
        raise TypeError(f"instruments is {short(instruments)}, expected a list of upt.Instrument") from None
    if not count:
        return None, 0
    try:
        if count == 1:
            return instruments[0]._packed(), 1
        return b"".join([one._packed() for one in instruments]), count
    except (AttributeError, TypeError, ValueError, OverflowError, struct.error):
        return (_native.Instrument * count)(*[_recorded(at, one) for at, one in enumerate(instruments)]), count


def _recorded(at: int, one: Instrument) -> _native.Instrument:
    """An instrument's struct, or an error that names its place in the list."""
    if not isinstance(one, Instrument):
        raise TypeError(f"instruments[{at}] is {short(one)}, expected an upt.Instrument")
    try:
        return one.record()
    except (TypeError, ValueError) as error:
        raise type(error)(f"instruments[{at}].{error}") from None
