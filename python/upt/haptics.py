"""Forces of one tool for a hand, from a thread of its own."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING

from upt import _native
from upt._arrays import number
from upt._library import check, lib
from upt._native import HapticForce

if TYPE_CHECKING:
    from upt.instrument import Instrument
    from upt.scene import Scene


class Haptics:
    """A tool that a hand feels: `render` gives the force on it at 1 kHz, while another thread steps the scene.

    The steps are driven as before, with this tool among their instruments. No step may be in flight when it is made.

    Args:
        scene: A scene that corrects.
        tool: Shape, friction and grasp as in the steps; position and rotation say where it is first.
        instrument: Its place in the list of instruments that drives the steps.
        blend_ms: What a new step puts elsewhere is blended in over this time; 0: 25.
        step_latency_ms: How old a step is when it arrives; 0: as long as it took.
        force_limit: Longest force, N; 0: no limit.
        damping_limit: What the passivity controller damps with at most, N s/m; 0: 5.
        passivity: Whether the passivity observer and controller are at work.

    Raises:
        upt.UnsupportedError: the bundle has no linear response or corrections, or the scene does not correct.
        upt.BusyError: a step is in flight.
    """

    def __init__(
        self,
        scene: Scene,
        tool: Instrument,
        instrument: int = 0,
        *,
        blend_ms: float = 0.0,
        step_latency_ms: float = 0.0,
        force_limit: float = 0.0,
        damping_limit: float = 0.0,
        passivity: bool = True,
    ) -> None:
        if not hasattr(tool, "record"):
            raise TypeError(f"tool is {tool!r}, expected an upt.Instrument")
        described = tool.record()
        options = _native.HapticsOptions(
            instrument=instrument,
            tool=ctypes.addressof(described),
            blend_ms=blend_ms,
            step_latency_ms=step_latency_ms,
            force_limit_n=force_limit,
            damping_limit_n_s_per_m=damping_limit,
            passivity=passivity,
        )
        handle = ctypes.c_void_p()
        check(lib.upt_haptics_create(scene._handle, ctypes.byref(options), ctypes.byref(handle)))
        self._handle = handle.value
        self._destroy = weakref.finalize(self, lib.upt_haptics_destroy, handle.value)

    def render(
        self,
        time: float,
        position: Sequence[float],
        rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        velocity: Sequence[float] | None = None,
    ) -> HapticForce:
        """The force on the tool at a pose.

        Args:
            time: The host's clock, s; never before that of the last call.
            position: In the mesh's frame, metres.
            rotation: Unit quaternion x, y, z, w.
            velocity: Of the position, m/s; None: that between the last two poses.

        Raises:
            upt.NonFiniteError, upt.ArgumentError: a pose or time that cannot be.
            upt.StateError: the scene was closed.
        """
        pose = _native.HapticPose(
            time_s=number(time, "time"),
            position_m=position,
            rotation=rotation,
            has_velocity=velocity is not None,
            velocity_m_per_s=(0.0, 0.0, 0.0) if velocity is None else velocity,
        )
        out = HapticForce()
        check(lib.upt_haptics_render(self._handle, ctypes.byref(pose), ctypes.byref(out)))
        return out

    def close(self) -> None:
        """Destroys the object; the scene stays usable. Also done when the object is collected."""
        self._destroy()
