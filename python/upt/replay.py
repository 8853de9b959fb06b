"""Recorded sessions: what a scene was given, step by step, for `upt replay --verify` on any machine."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upt._arrays import Floats
from upt._native import Cut, Mode, SceneOptions, Shape
from upt.instrument import Instrument
from upt.loads import Loads
from upt.model import Model
from upt.scene import Scene

_VERSION = 1
_OPTIONS = ("step_s", "damping_per_s", "corrections", "substeps")


class Recorder:
    """A new scene whose steps and cuts go to a file of JSON lines (docs/reference/formats.md) as they are made.

        model = upt.Model(upt.bundle("liver-coarse"), portable=True)
        with upt.Recorder(model, "exam.replay", step_s=0.02) as recorder:
            u = recorder.step([probe])

    Open the model with `portable=True`: only then do other processors compute the same bits. Without the end that
    `close` writes a file counts as cut off.

    Args:
        model: what the scene is made of.
        path: the file, which is written over.
        every: after how many steps the hash of all displacements is written, 1 or more.
        options: fields of `upt.SceneOptions` that a replay can hold: step_s, damping_per_s, corrections (without
            a budget, which counts by the clock), substeps.
    """

    def __init__(self, model: Model, path: str | os.PathLike[str], *, every: int = 1, **options: Any) -> None:
        if every < 1:
            raise ValueError(f"every is {every}; give 1 or more")
        for name in options:
            if name not in _OPTIONS:
                raise TypeError(f"a replay cannot hold the option {name!r}; it can hold {', '.join(_OPTIONS)}")
        fields = SceneOptions(**options)
        corrections = fields.corrections
        if corrections.budget_us:
            raise ValueError(
                "corrections: a replay cannot hold a budget, which counts by the clock; give a target or a count"
            )
        self.scene: Scene = model.scene(**options)
        described = model.describe()
        header = {
            "upt_replay": _VERSION,
            "bundle": described["name"],
            "bundle_sha256": described["bundle_sha256"],
            "portable": str(described["instruction_set"]).startswith("Portable"),
            "scene": {
                "step_s": fields.step_s,
                "damping_per_s": fields.damping_per_s,
                "corrections": {
                    "mode": corrections.mode.name.lower(),
                    "count": corrections.count,
                    "target_mm": corrections.target_mm,
                },
                "substeps": fields.substeps,
            },
        }
        self._every, self._steps, self._lines = every, 0, 0
        self._file = open(path, "w", encoding="utf-8")
        self._write(header)

    def step(self, instruments: Sequence[Instrument] = (), *, loads: Loads | None = None) -> Floats:
        """A step as `Scene.step` makes it, of instruments (no hulls) and gravity; other loads are refused."""
        if loads is not None and loads != Loads(gravity=loads.gravity, gravity_at_rest=loads.gravity_at_rest):
            raise ValueError("loads: a replay can hold gravity, and no other load")
        given: dict[str, Any] = {"instruments": [_fields(tool) for tool in instruments]}
        if loads is not None:
            given["gravity"] = _exact(loads.gravity)
            given["gravity_at_rest"] = _exact(loads.gravity_at_rest)
        field = self.scene.step(instruments, loads=loads)
        self._steps += 1
        if self._steps % self._every == 0:
            given["sha256"] = hashlib.sha256(field.astype("<f4").tobytes()).hexdigest()
        self._lines += 1
        self._write({"step": given})
        return field

    def cut(self, poses: ArrayLike, stroke: int = 0) -> Cut:
        """A cut as `Scene.cut` makes it."""
        path = np.asarray(poses, np.float32)
        made = self.scene.cut(path, stroke)
        self._lines += 1
        rows = [_exact(point) for point in path.reshape(-1, 3)]
        self._write({"cut": {"stroke": stroke, "points": path.shape[1], "poses": rows}})
        return made

    def close(self) -> None:
        """Writes the end of the file."""
        if not self._file.closed:
            self._write({"end": self._lines})
            self._file.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write(self, line: dict[str, Any]) -> None:
        self._file.write(json.dumps(line) + "\n")


def _exact(values: Any) -> list[float]:
    """The numbers that the library gets, float32."""
    return [float(value) for value in np.asarray(values, np.float32)]


def _fields(tool: Instrument) -> dict[str, Any]:
    record = tool.record()
    if record.shape == Shape.HULL:
        raise ValueError("instruments: a replay cannot hold a hull")
    return {
        "shape": record.shape.name.lower(),
        "position": list(record.position),
        "rotation": list(record.rotation),
        "half_extents": list(record.half_extents),
        "radius": record.radius,
        "mode": "grasp" if record.mode == Mode.GRASP else "slide",
        "friction": record.friction,
        "tear_off_mn": record.tear_off_mn,
    }
