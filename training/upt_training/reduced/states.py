"""Trajectories in reduced coordinates: what training and most of the evaluation need, a few MB instead of GB.

Per frame: `b = Phi^T (u - L)`, `z = Psi^T L`, `p = Phi^T L`, contact flags, and norms that turn errors of `b` into the
mean squared error of the field: `|u - u'|^2 = |R|^2 - |b|^2 + |b - b'|^2`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from upt_training.reduced.modes import Modes
from upt_training.reduced.transfer import Source


@dataclass
class States:
    """Arrays over `[cases, frames]`; lengths in mm. After its last frame a case is zero (`length [cases]`)."""

    b: np.ndarray
    z: np.ndarray
    p: np.ndarray
    contact: np.ndarray
    changed: np.ndarray
    push: np.ndarray
    response_norm: np.ndarray
    response_jump: np.ndarray
    residual_square: np.ndarray
    field_square: np.ndarray
    scheme: np.ndarray
    split: np.ndarray
    source: np.ndarray
    length: np.ndarray
    nodes: np.ndarray

    @property
    def valid(self) -> np.ndarray:
        """Which frames a case has, `[cases, frames]`."""
        return np.arange(self.frames) < self.length[:, None]

    @property
    def cases(self) -> int:
        return len(self.b)

    @property
    def frames(self) -> int:
        return self.b.shape[1]

    @property
    def modes(self) -> int:
        return self.b.shape[2]

    def pick(self, mask: np.ndarray) -> States:
        """The cases where `mask` holds."""
        return States(**{name: getattr(self, name)[mask] for name in _PER_CASE}, nodes=self.nodes)

    def save(self, path: Path) -> None:
        temporary = path.with_suffix(".partial.npz")
        np.savez(temporary, **{f.name: getattr(self, f.name) for f in fields(self)})
        temporary.rename(path)


_PER_CASE = tuple(f.name for f in fields(States) if f.name != "nodes")
_PER_FRAME = tuple(name for name in _PER_CASE if name not in ("scheme", "split", "source", "length"))


def load_states(path: Path) -> States:
    with np.load(path, allow_pickle=False) as file:
        return States(**{name: file[name] for name in file.files})


def join_states(parts: list[States]) -> States:
    """Datasets of the same mesh and modes behind one another."""
    frames = max(part.frames for part in parts)

    def values(part: States, name: str) -> np.ndarray:
        array = getattr(part, name)
        return lengthened(array, frames, axis=1) if name in _PER_FRAME else array

    joined = {name: np.concatenate([values(part, name) for part in parts]) for name in _PER_CASE}
    return States(**joined, nodes=parts[0].nodes)


def lengthened(array: np.ndarray, length: int, axis: int) -> np.ndarray:
    """`array` with zeros behind it, up to `length` entries along `axis`."""
    padding = [(0, 0)] * array.ndim
    padding[axis] = (0, length - array.shape[axis])
    return np.pad(array, padding)


def project_cases(
    source: Source,
    modes: Modes,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> States:
    """Every frame of a source's cases in reduced coordinates, computed on the cases' own mesh."""
    cases = source.cases
    residual_modes, response_modes = source.adjoint(modes.residual), source.adjoint(modes.response)
    collected: dict[str, list] = {name: [] for name in _PER_CASE}
    for index, case in enumerate(cases):
        linear, field = source.own_fields(case)
        jump = np.zeros(case.frames, np.float32)
        jump[1:] = np.sqrt(source.squares(np.diff(linear, axis=0)))
        collected["field_square"].append(source.squares(field))
        residual = field - linear
        collected["b"].append(residual @ residual_modes.T)
        collected["z"].append(linear @ response_modes.T)
        collected["p"].append(linear @ residual_modes.T)
        collected["contact"].append(case.in_contact())
        collected["changed"].append(case.set_changed())
        collected["push"].append(case.largest_push().astype(np.float32))
        collected["response_norm"].append(np.sqrt(source.squares(linear)).astype(np.float32))
        collected["response_jump"].append(jump)
        collected["residual_square"].append(source.squares(residual))
        collected["scheme"].append(case.scheme)
        collected["split"].append(case.split)
        collected["source"].append(case.path.name)
        collected["length"].append(case.frames)
        progress(index + 1, len(cases))
    frames = max(collected["length"])
    for name in _PER_FRAME:
        collected[name] = [lengthened(np.asarray(values), frames, axis=0) for values in collected[name]]
    arrays = {name: np.array(values) for name, values in collected.items()}
    return States(**arrays, nodes=np.array(modes.residual.shape[1] // 3))
