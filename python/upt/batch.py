"""Many scenes of one model, stepped side by side over all cores: reinforcement learning, sweeps, evaluation."""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upt._arrays import Floats, floats
from upt.instrument import Instrument
from upt.model import Model
from upt.scene import Scene

if TYPE_CHECKING:
    if sys.version_info >= (3, 12):
        from typing import Unpack
    else:
        from typing_extensions import Unpack

    from upt._native import SceneOptionsKeywords

T = TypeVar("T")


def core_count() -> int:
    """Cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class BatchedScenes:
    """`count` scenes of one model; each call steps all of them, each scene on one thread, over all cores.

    Args:
        model: what to step; its tables are shared.
        count: N, the number of scenes.
        workers: threads that step; None: one for each core.
        options: fields of `upt.SceneOptions`. `threads` is 1 unless stated.
    """

    def __init__(
        self, model: Model, count: int, *, workers: int | None = None, **options: Unpack[SceneOptionsKeywords]
    ) -> None:
        if not isinstance(count, int):
            raise TypeError(f"count is {count!r}, expected a number of scenes")
        if count < 1:
            raise ValueError(f"count is {count}, must be at least 1")
        options.setdefault("threads", 1)
        #: The scenes, each with all that a scene can do.
        self.scenes: list[Scene] = [model.scene(**options) for _ in range(count)]
        self.workers = min(workers or core_count(), count)
        # The calling thread is one of the workers.
        self._pool = ThreadPoolExecutor(self.workers - 1, "upt") if self.workers > 1 else None

    def __len__(self) -> int:
        return len(self.scenes)

    def map(self, function: Callable[[int, Scene], T]) -> list[T]:
        """`function(i, scene)` for each scene, on all workers; the results in order.

        All scenes are called even where one fails; then the error of the first that failed is raised.
        """
        results: list[T | None] = [None] * len(self.scenes)
        errors: list[tuple[int, BaseException]] = []
        turns = itertools.count()  # `next` on it is atomic

        def work() -> None:
            while (i := next(turns)) < len(self.scenes):
                try:
                    results[i] = function(i, self.scenes[i])
                except BaseException as error:
                    errors.append((i, error))

        beside = [self._pool.submit(work) for _ in range(self.workers - 1)] if self._pool else []
        work()
        for other in beside:
            other.result()
        if errors:
            i, error = min(errors, key=lambda pair: pair[0])
            error.add_note(f"scene {i} of {len(self.scenes)}; {len(errors)} failed")
            raise error
        return results  # type: ignore[return-value]

    def step(
        self,
        instruments: Sequence[Sequence[Instrument]] | None = None,
        *,
        contacts: Sequence[tuple[ArrayLike, ArrayLike] | None] | None = None,
        collision: ArrayLike | None = None,
        displacement: ArrayLike | None = None,
        out: Floats | None = None,
    ) -> Floats:
        """One step of each scene with its own input, as `Scene.step`; returns `[N, n, 3]`, mm.

        Args:
            instruments: those of each scene; what the tissue does to them: `batch.scenes[i].readings()`.
            contacts: `(nodes [m], vectors [m, 3])` of each scene, None for no contact.
            collision: `[N, K, 3]`, mm.
            displacement: `[N, K, 3]`, mm.
            out: `[N, n, 3]` to write to.
        """
        for entries, name in ((instruments, "instruments"), (contacts, "contacts")):
            if entries is not None and len(entries) != len(self.scenes):
                wanted = f"must have one for each of {len(self.scenes)} scenes"
                raise ValueError(f"{name} has {len(entries)} entries, {wanted}")
        u = self._each(displacement, "displacement")
        c = self._each(collision, "collision")
        result = self._output(out)

        def step(i: int, scene: Scene) -> None:
            scene.step(
                () if instruments is None else instruments[i],
                contacts=None if contacts is None else contacts[i],
                collision=None if c is None else c[i],
                displacement=None if u is None else u[i],
                out=result[i],
            )

        self.map(step)
        return result

    def read(self, out: Floats | None = None) -> Floats:
        """The last published states `[N, n, 3]`, mm."""
        result = self._output(out)
        for scene, row in zip(self.scenes, result, strict=True):
            scene.read(row)
        return result

    def set_region(self, nodes: ArrayLike | None) -> None:
        """The same region for every scene, as `Scene.set_region`."""
        for scene in self.scenes:
            scene.set_region(nodes)

    def reset(self, which: ArrayLike | None = None) -> None:
        """Back to rest: all scenes, or those of `which` (indices, or `[N]` booleans)."""
        chosen = np.arange(len(self.scenes)) if which is None else np.arange(len(self.scenes))[np.asarray(which)]
        for i in chosen:
            self.scenes[i].reset()

    def close(self) -> None:
        """Ends the workers and frees the scenes."""
        if self._pool:
            self._pool.shutdown()
        for scene in self.scenes:
            scene.close()

    def __enter__(self) -> BatchedScenes:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _each(self, fields: ArrayLike | None, name: str) -> NDArray[np.float32] | None:
        if fields is None:
            return None
        array = floats(fields, name)
        expected = (len(self.scenes), self.scenes[0].node_count, 3)
        if array.shape != expected:
            raise ValueError(f"{name} has shape {array.shape}, expected {expected}")
        return array

    def _output(self, out: Floats | None) -> Floats:
        shape = (len(self.scenes), self.scenes[0].out_count, 3)
        if out is None:
            return np.empty(shape, np.float32)
        if out.dtype != np.float32 or out.shape != shape or not out.flags.c_contiguous or not out.flags.writeable:
            raise ValueError(f"out must be a writeable C-contiguous float32 array of shape {shape}")
        return out
