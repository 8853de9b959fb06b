"""Static equilibria in reduced coordinates: what `upt dataset --schemes static` found, one row an equilibrium.

Their frames have no order in time. A sample says where the residual comes to rest at one contact, `b` for `z`; held
for ever it is a fixed point of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from upt_training.reduced.modes import Modes
from upt_training.reduced.trajectories import Case
from upt_training.reduced.transfer import Source


@dataclass
class Statics:
    """Arrays over `[samples]`; lengths in mm. `site` is one number for all depths of a place."""

    b: np.ndarray
    z: np.ndarray
    p: np.ndarray
    push: np.ndarray
    response_norm: np.ndarray
    residual_square: np.ndarray
    scheme: np.ndarray
    source: np.ndarray
    site: np.ndarray
    coarse: np.ndarray

    @property
    def count(self) -> int:
        return len(self.b)

    def pick(self, mask: np.ndarray) -> Statics:
        """The samples where `mask` holds."""
        return Statics(**{f.name: getattr(self, f.name)[mask] for f in fields(self)})

    def save(self, path: Path) -> None:
        temporary = path.with_suffix(".partial.npz")
        np.savez(temporary, **{f.name: getattr(self, f.name) for f in fields(self)})
        temporary.rename(path)


def load_statics(path: Path) -> Statics:
    with np.load(path, allow_pickle=False) as file:
        return Statics(**{name: file[name] for name in file.files})


def join_statics(parts: list[Statics]) -> Statics | None:
    """All samples behind one another, sites numbered anew; None where there are none."""
    if not parts:
        return None
    joined = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Statics)}
    starts = np.cumsum([0] + [int(part.site.max()) + 1 for part in parts])
    joined["site"] = np.concatenate([part.site + start for part, start in zip(parts, starts, strict=False)])
    return Statics(**joined)


def sites_of(case: Case) -> np.ndarray:
    """Site of each frame from 1 on, counted from 0: frames behind one another that touch the same nodes."""
    return np.cumsum(case.set_changed()[1:]) - 1


def project_statics(
    source: Source,
    modes: Modes,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Statics:
    """Every equilibrium of a source's cases, computed on the cases' own mesh."""
    parts = []
    residual_modes, response_modes = source.adjoint(modes.residual), source.adjoint(modes.response)
    for index, case in enumerate(source.cases):
        frames = np.arange(1, case.frames)
        linear, field = source.own_fields(case, frames)
        residual = field - linear
        parts.append(
            Statics(
                b=residual @ residual_modes.T,
                z=linear @ response_modes.T,
                p=linear @ residual_modes.T,
                push=case.largest_push()[1:].astype(np.float32),
                response_norm=np.sqrt(source.squares(linear)).astype(np.float32),
                residual_square=source.squares(residual),
                scheme=np.repeat(case.scheme, len(frames)),
                source=np.repeat(case.path.name, len(frames)),
                site=sites_of(case),
                coarse=np.repeat(source.transfer is not None, len(frames)),
            )
        )
        progress(index + 1, len(source.cases))
    joined = join_statics(parts)
    assert joined is not None
    return joined
