"""Recorded sessions: what a scene was given, step by step, for `upt replay --verify` on any machine."""

from __future__ import annotations

import ctypes
import os
from types import TracebackType

from upt._library import check, lib
from upt._native import Status


class Recorded:
    """What a scene records of itself: `Scene` has it. `upt.Recorder` writes it to a file."""

    _handle: int | None

    def record(self, every: int = 1) -> None:
        """Begins to record what the scene is given; `end_record` ends it.

        Args:
            every: after how many steps the hash of what `read` gives is written, 1 or more.

        Raises:
            upt.StateError: a recording is on, or the last one has not been taken.
            upt.UnsupportedError: the scene has a budget of time or a mesh of its own.
        """
        if every < 1:
            raise ValueError(f"every is {every}; give 1 or more")
        check(lib.upt_scene_record(self._handle, every))

    def end_record(self) -> None:
        """Ends the recording; its last lines are there for `take_record`."""
        check(lib.upt_scene_record(self._handle, 0))

    def take_record(self) -> bytes:
        """The lines of the recording that were not taken before, UTF-8. Also while a step is in flight."""
        needed = ctypes.c_uint64()
        check(lib.upt_scene_take_record(self._handle, None, 0, ctypes.byref(needed)))
        while needed.value:
            room = ctypes.create_string_buffer(needed.value)
            status = lib.upt_scene_take_record(self._handle, room, len(room), ctypes.byref(needed))
            # A step in flight may have added a line.
            if status == Status.ARGUMENT and needed.value > len(room):
                continue
            check(status)
            return room.raw[: needed.value]
        return b""


class Recorder:
    """Writes to a file what a scene is given, by all of its methods, as JSON lines (docs/reference/formats.md).

        model = upt.Model(upt.bundle("liver-coarse"), portable=True)
        scene = model.scene(step_s=0.02, corrections=3)
        with upt.Recorder(scene, "exam.replay"):
            scene.step([probe])

    Open the model with `portable=True`: only then do other processors compute the same bits. Without the end that
    `close` writes a file counts as cut off.

    Args:
        scene: what is recorded.
        path: the file, which is written over.
        every: after how many steps the hash of the displacements is written, 1 or more.
    """

    def __init__(self, scene: Recorded, path: str | os.PathLike[str], *, every: int = 1) -> None:
        self.scene = scene
        file = open(path, "wb")
        try:
            scene.record(every)
        except BaseException:
            file.close()
            raise
        self._file = file

    def flush(self) -> None:
        """Writes what there is, so that a long session does not fill the memory and outlives a crash."""
        self._file.write(self.scene.take_record())
        self._file.flush()

    def close(self) -> None:
        """Ends the recording and the file."""
        if not self._file.closed:
            try:
                self.scene.end_record()
                self.flush()
            finally:
                self._file.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
