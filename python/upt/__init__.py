"""Soft tissue in real time: libupt for Python.

    import upt

    model = upt.Model(upt.bundle("liver-coarse"))  # in the package
    scene = model.scene()
    u = scene.step(contacts=([17, 18], [[0, 0, -4], [0, 0, -4]]))  # [K, 3], mm, 50 ms later

Shapes and units: positions and displacements are float32 `[n, 3]`, mm; forces mN; times seconds, but in the statistics
milliseconds. What a call may raise is in `upt.errors`; conventions of the library itself are in docs/reference/abi.md.
"""

from __future__ import annotations

import json
from typing import Any

from upt._library import check, ensure_started, init, lib, read_text
from upt._native import (
    ABI_VERSION,
    Corrections,
    CorrectionsMode,
    Cut,
    Flag,
    GuardPolicy,
    HapticForce,
    IndexSet,
    InstrumentContact,
    InstrumentReading,
    Kernel,
    Kind,
    LogLevel,
    Mode,
    ModelInfo,
    ModelOptions,
    Precision,
    Provider,
    SceneOptions,
    SceneStats,
    SceneTiming,
    Shape,
    Status,
    StepPath,
    TieReading,
    ViewKind,
)
from upt.batch import BatchedScenes
from upt.bundles import bundle
from upt.cuts import Blade, Surface
from upt.download import download
from upt.errors import (
    ArgumentError,
    BundleError,
    BusyError,
    Error,
    GuardError,
    OutOfMemoryError,
    PanicError,
    RuntimeLibraryError,
    StateError,
    UnsupportedError,
)
from upt.haptics import Haptics
from upt.instrument import Hull, Instrument
from upt.loads import Loads, PointForce, Support
from upt.log import set_log
from upt.model import Model
from upt.replay import Recorder
from upt.scene import Scene
from upt.ties import Tie

#: The library's version.
__version__: str = lib.upt_version().decode()


def providers() -> list[dict[str, Any]]:
    """What can run a model: `[{"name": "cpu", "available": True, "reason": ""}, ...]`."""
    ensure_started()
    listed: list[dict[str, Any]] = json.loads(read_text(lib.upt_providers))
    return listed


def shutdown() -> None:
    """Shuts the library down. Call it after closing all models, and before exit if you used a GPU provider."""
    check(lib.upt_shutdown())


__all__ = [
    "ABI_VERSION",
    "ArgumentError",
    "BatchedScenes",
    "Blade",
    "BundleError",
    "BusyError",
    "Corrections",
    "CorrectionsMode",
    "Cut",
    "Error",
    "Flag",
    "GuardError",
    "OutOfMemoryError",
    "GuardPolicy",
    "HapticForce",
    "Haptics",
    "Hull",
    "IndexSet",
    "Instrument",
    "InstrumentContact",
    "InstrumentReading",
    "Kernel",
    "Kind",
    "Loads",
    "LogLevel",
    "Mode",
    "Model",
    "ModelInfo",
    "ModelOptions",
    "PanicError",
    "PointForce",
    "Precision",
    "Provider",
    "Recorder",
    "RuntimeLibraryError",
    "Scene",
    "SceneOptions",
    "SceneStats",
    "SceneTiming",
    "Shape",
    "StateError",
    "Status",
    "StepPath",
    "Surface",
    "Support",
    "Tie",
    "TieReading",
    "UnsupportedError",
    "ViewKind",
    "bundle",
    "download",
    "init",
    "providers",
    "set_log",
    "shutdown",
]
