"""One deforming body: `u(t + dt) = M(u(t), c(t))`."""

from __future__ import annotations

import ctypes
import json
import struct
import sys
import weakref
from collections.abc import Sequence
from reprlib import repr as short
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from upt._arrays import Floats, Indices, Outputs, address, indices, number, vectors
from upt._input import Inputs
from upt._library import check, lib
from upt._native import (
    InstrumentContact,
    InstrumentReading,
    SceneOptions,
    SceneStats,
    SceneTiming,
    Status,
    View,
    ViewKind,
)
from upt.cuts import Cuts
from upt.instrument import Instrument, records
from upt.loads import Loads
from upt.replay import Recorded
from upt.ties import Ties

if TYPE_CHECKING:
    if sys.version_info >= (3, 12):
        from typing import Unpack
    else:
        from typing_extensions import Unpack

    from upt._native import SceneOptionsKeywords

_step = lib.upt_scene_step

#: How long `wait` waits when nothing is stated, milliseconds: 49 days.
FOREVER_MS = 0xFFFFFFFF


class OpenModel(Protocol):
    """What a scene needs of its `Model`."""

    _handle: int | None

    @property
    def node_count(self) -> int:
        """Nodes of the model's mesh."""
        ...


class Scene(Cuts, Recorded, Ties):
    """One deforming body, made by `Model.scene`.

    Arrays are float32, `[n, 3]`, mm; node indices are uint32. An input that is C-contiguous and of this type is not
    copied (short lists of contacts are: it is faster), and a result goes straight into `out` where one is given; a
    scene keeps the last arrays that it was given. The GIL is released during each call, so scenes step on several
    threads at once; one scene is used by one thread at a time (another gets `upt.BusyError`).
    """

    def __init__(self, model: OpenModel, **options: Unpack[SceneOptionsKeywords]) -> None:
        handle = ctypes.c_void_p()
        fields = SceneOptions(**options)
        check(lib.upt_scene_create(model._handle, ctypes.byref(fields), ctypes.byref(handle)))
        self._handle = handle.value
        self._destroy = weakref.finalize(self, lib.upt_scene_destroy, handle.value)
        self._steps, self._frames, self._others = Outputs(), Outputs(), Outputs()
        self._point_count = 0
        self._instrument_count = 0
        self._tie_count = 0
        self._node_count = model.node_count if fields.mesh_path is None else _node_count_of(fields.mesh_path)
        self._out_count = self._node_count
        self._inputs = Inputs(self._node_count)

    @property
    def node_count(self) -> int:
        """K, the nodes of the scene's mesh and the copies that cuts have made."""
        return self._node_count

    @property
    def out_count(self) -> int:
        """Rows that a step writes: the region's, or K."""
        return self._out_count

    def step(
        self,
        instruments: Sequence[Instrument] = (),
        *,
        contacts: tuple[ArrayLike, ArrayLike] | None = None,
        collision: ArrayLike | None = None,
        displacement: ArrayLike | None = None,
        time_s: float = 0.0,
        loads: Loads | None = None,
        out: Floats | None = None,
    ) -> Floats:
        """One step. Instruments, contacts or a collision field drive it; without any the tissue moves on by itself.

        Args:
            instruments: rigid instruments where they will be at the end of the step, at most 64; their contact is
                solved. From the last step's poses they get there on a line, or are put there where that is further than
                40 mm. Pass every instrument every time, in the same order: the scene remembers each place of the list.
                What the tissue does to them: `readings`.
            contacts: nodes `[m]` in contact, each once, in any order, and their displacement at the end of the step,
                `[m, 3]`, mm.
            collision: `c(t)`, `[K, 3]`, mm, zero but at the nodes in contact: their displacement at the end of the
                step.
            displacement: `u(t)`, `[K, 3]`, mm, to start from; None takes the scene's own state. Not with instruments.
            time_s: the moment of the end of the step on a clock of your own, s, from which `present` counts.
            loads: gravity, forces, pressure and ties that act meanwhile; only in scenes with corrections.
            out: `[n, 3]` to write to (n: K, or the region's count); None makes a new array.

        Returns:
            `u(t + dt)`, `[n, 3]`, mm.

        Raises:
            upt.ArgumentError: two things drive the step.
            upt.UnsupportedError: the bundle has no linear response to solve the contact of instruments with; use
                `contacts` of this class for the nodes that they touch.
        """
        at, count, kept = self._inputs.place(instruments, contacts, collision, displacement, time_s, loads)
        result, place, length, _ = self._steps.place(out, self._out_count)
        if (status := _step(self._handle, at, place, length)) < 0:
            check(status)
        self._instrument_count = count
        self._tie_count = 0 if loads is None else len(loads.ties)
        return result

    def step_field(
        self, displacement: ArrayLike | None = None, collision: ArrayLike | None = None, out: Floats | None = None
    ) -> Floats:
        """One step of dense fields, `u(t + dt) = M(u(t), c(t))`, as the paper writes it: `step` with these two."""
        return self.step(collision=collision, displacement=displacement, out=out)

    def readings(self) -> list[InstrumentReading]:
        """What the tissue did to each instrument of the last step, in their order.

        Force (mN), torque about the instrument's position (mN mm), contacts, penetration (mm), whether its grasp tore
        off. After a submit with another number of instruments, only once the step has finished.
        """
        found = [InstrumentReading() for _ in range(self._instrument_count)]
        array = (InstrumentReading * len(found))(*found)
        check(lib.upt_scene_read_instruments(self._handle, array if found else None, len(found)))
        return list(array)

    def instrument_contacts(self) -> list[InstrumentContact]:
        """The points of the surface that pushed or held instruments at the end of the last step.

        Ascending by instrument: its place in the list, position (mm), force on it (mN).
        """
        needed = ctypes.c_uint64()
        find = lib.upt_scene_read_instrument_contacts
        check(find(self._handle, None, 0, ctypes.byref(needed)))
        array = (InstrumentContact * needed.value)()
        if needed.value:
            check(find(self._handle, array, len(array), ctypes.byref(needed)))
        return list(array)

    def contacts(self, instruments: Sequence[Instrument]) -> tuple[Indices, Floats]:
        """The nodes that rigid instruments touch and the displacement that they impose: the `contacts` of a step.

        For hosts that want nodes and vectors, and for bundles without a linear response; with one, a step
        solves contact. Pass every instrument every time, in the same order: the scene remembers what each one touches.

        Returns:
            `nodes [m]` and `vectors [m, 3]`, mm.
        """
        count = ctypes.c_uint64()
        arguments = (self._handle, *records(instruments))
        find = lib.upt_scene_contacts_from_instruments
        check(find(*arguments, None, None, 0, ctypes.byref(count)))
        nodes, contact = np.empty(count.value, np.uint32), np.empty((count.value, 3), np.float32)
        if count.value:
            check(find(*arguments, address(nodes), address(contact), count.value, ctypes.byref(count)))
        return nodes, contact

    def contact_force(self, out: Floats | None = None) -> Floats:
        """The reaction on the instrument at the last step's contact nodes, in their order: `[m, 3]`, mN."""
        result, place, length, _ = self._others.place(out, self.stats.contact_count)
        check(lib.upt_scene_read_contact_force(self._handle, place, length))
        return result

    def read(self, out: Floats | None = None, *, view: ViewKind | str = ViewKind.REGION) -> Floats:
        """The last published state `[n, 3]`, mm, in the view's order: the region, or the attached points ("points")."""
        seen, count = self._seen(view)
        result, place, length, _ = self._others.place(out, count)
        check(lib.upt_scene_read(self._handle, ctypes.byref(seen), place, length))
        return result

    def submit(
        self,
        instruments: Sequence[Instrument] = (),
        *,
        contacts: tuple[ArrayLike, ArrayLike] | None = None,
        collision: ArrayLike | None = None,
        displacement: ArrayLike | None = None,
        time_s: float = 0.0,
        loads: Loads | None = None,
    ) -> None:
        """Starts a step on the scene's worker and returns at once; arguments as in `step`, copied."""
        at, count, kept = self._inputs.place(instruments, contacts, collision, displacement, time_s, loads)
        check(lib.upt_scene_submit(self._handle, at))
        self._instrument_count = count
        self._tie_count = 0 if loads is None else len(loads.ties)

    def poll(self) -> bool:
        """True when the submitted step has finished; raises its error, once."""
        return check(lib.upt_scene_poll(self._handle)) != Status.PENDING

    def wait(self, timeout: float | None = None) -> bool:
        """Waits for the submitted step, at most `timeout` seconds; False if the time is up; raises the step's error."""
        seconds = None if timeout is None else number(timeout, "timeout")
        milliseconds = FOREVER_MS if seconds is None else int(min(max(seconds * 1000, 0), FOREVER_MS))
        return check(lib.upt_scene_wait(self._handle, milliseconds)) != Status.PENDING

    def sample(self, alpha: float, out: Floats | None = None, *, view: ViewKind | str = ViewKind.REGION) -> Floats:
        """Between the last two states (`alpha` 0: the one before, 1: the last); otherwise as `read`."""
        seen, count = self._seen(view)
        result, place, length, _ = self._others.place(out, count)
        check(lib.upt_scene_sample(self._handle, number(alpha, "alpha"), ctypes.byref(seen), place, length))
        return result

    def present(
        self,
        when: float,
        instruments: Sequence[Instrument] = (),
        *,
        contacts: tuple[ArrayLike, ArrayLike] | None = None,
        view: ViewKind | str = ViewKind.REGION,
        out: Floats | None = None,
    ) -> Floats:
        """The tissue at a moment between steps, with the instruments where they are then: frames without lag.

        Works while a step is in flight; make the first call before the first submit. Another thread may step meanwhile.

        Args:
            when: on the clock of the steps' `time_s`, s; where they have none, the time since the last published step.
                Velocities are followed for two steps at most.
            instruments: as in `step`, where they are at that moment.
            contacts: as in `step`, where the nodes are at that moment, for scenes that nodes drive.
            view: `upt.ViewKind` or its name: region, points, or surface: the vertices of the last `surface`, each from
                its place at rest.
            out: `[n, 3]` to write to, in the view's order.

        Returns:
            `[n, 3]`, mm.

        Raises:
            upt.UnsupportedError: the scene has no linear response or does not correct; use `sample`.
            upt.StateError: the body has changed since its `surface` was asked for.
        """
        at, _, kept = self._inputs.place(instruments, contacts, None, None, 0.0)
        seen, count = self._seen(view)
        places = self._frames if seen.kind == ViewKind.REGION else self._others
        result, place, length, _ = places.place(out, count)
        check(lib.upt_scene_present(self._handle, at, number(when, "when"), ctypes.byref(seen), place, length))
        return result

    def _seen(self, view: ViewKind | str) -> tuple[View, int]:
        """A view of the scene's own, and how many rows it has."""
        seen = View(kind=view)
        if seen.kind == ViewKind.NODES:
            raise ValueError("view: nodes are what `decode` takes")
        counts = {ViewKind.POINTS: self._point_count, ViewKind.SURFACE: self._vertex_count}
        return seen, counts.get(seen.kind, self._out_count)

    def set_region(self, nodes: ArrayLike | None) -> None:
        """Restricts what a step decodes and returns to these nodes `[n]`, in this order; None: all nodes."""
        chosen = indices(() if nodes is None else nodes, "nodes")
        if nodes is not None and not len(chosen):
            raise ValueError("nodes is empty; None means all nodes")
        check(lib.upt_scene_set_region(self._handle, address(chosen) if len(chosen) else None, len(chosen)))
        self._out_count = self._node_count if nodes is None else len(chosen)

    def decode(self, nodes: ArrayLike | None, out: Floats | None = None) -> Floats:
        """Displacement of any nodes `[n]` in the last state, whatever the region is: `[n, 3]`, mm; None: all nodes."""
        chosen = indices(() if nodes is None else nodes, "nodes")
        result, place, length, _ = self._others.place(out, self._node_count if nodes is None else len(chosen))
        seen = View(kind=ViewKind.NODES, nodes=None if nodes is None else address(chosen), node_count=len(chosen))
        check(lib.upt_scene_decode(self._handle, ctypes.byref(seen), place, length))
        return result

    def attach_points(self, points: ArrayLike | None) -> None:
        """Attaches points (rest positions `[n, 3]`, mm) in place of those attached before; None detaches all."""
        rest = vectors(np.empty((0, 3), np.float32) if points is None else points, "points")
        check(lib.upt_scene_attach_points(self._handle, address(rest) if len(rest) else None, len(rest)))
        self._point_count = len(rest)

    @property
    def stats(self) -> SceneStats:
        """What the last step did; works while a step is in flight."""
        stats = SceneStats()
        check(lib.upt_scene_read_stats(self._handle, ctypes.byref(stats)))
        return stats

    @property
    def timing(self) -> SceneTiming:
        """What the last step and its stages took, ms."""
        timing = SceneTiming()
        check(lib.upt_scene_read_timing(self._handle, ctypes.byref(timing)))
        return timing

    def save(self) -> bytes:
        """A snapshot; `restore` resumes from it to the bit."""
        needed = ctypes.c_uint64()
        check(lib.upt_scene_save(self._handle, None, 0, ctypes.byref(needed)))
        buffer = ctypes.create_string_buffer(needed.value)
        check(lib.upt_scene_save(self._handle, buffer, needed.value, None))
        return buffer.raw

    def restore(self, snapshot: bytes) -> None:
        """Back to a snapshot of the same model."""
        if not isinstance(snapshot, bytes):
            raise TypeError(f"snapshot is {short(snapshot)}, expected the bytes of `save`")
        check(lib.upt_scene_restore(self._handle, snapshot, len(snapshot)))
        self._instrument_count = 0
        self._fit()

    def reset(self) -> None:
        """Back to rest, with the intact body. The region and attached points stay."""
        check(lib.upt_scene_reset(self._handle))
        self._instrument_count = 0
        self._fit()

    def _resize(self, node_count: int) -> None:
        if node_count != self._node_count:
            self._node_count = self._out_count = node_count
            self._inputs = Inputs(node_count)

    def close(self) -> None:
        """Frees the scene after waiting for a step in flight. Also done when the object is collected."""
        status = self._destroy()
        if status is not None:
            check(status)

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _node_count_of(mesh: str) -> int:
    """K of a mesh file, from its header (docs/reference/formats.md)."""
    with open(mesh, "rb") as file:
        (length,) = struct.unpack("<Q", file.read(8))
        header = json.loads(file.read(length))
    count: int = header["positions"]["shape"][0]
    return count
