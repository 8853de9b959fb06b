"""Autoregressive rollouts in reduced coordinates, with the runtime's bound and fade applied at every step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from upt_training.reduced.network import Correction, bound, fade
from upt_training.reduced.states import States


@dataclass
class Limits:
    """`bound` and `fade` of the bundle's manifest."""

    relative: float = 0.6
    decay: float = 0.9
    start_push_mm: float = 40.0
    end_push_mm: float = 60.0


@dataclass
class Drive:
    """What the host imposes on a batch of sequences, `[n, T + 1, ...]`: row 0 is the step before the first."""

    z: Tensor
    p: Tensor
    contact: Tensor
    changed: Tensor
    push: Tensor
    response_norm: Tensor
    response_jump: Tensor

    def __getitem__(self, rows: Tensor) -> Drive:
        return Drive(**{name: value[rows] for name, value in vars(self).items()})


def drive_of(states: States) -> Drive:
    """The whole trajectories of `states`."""
    names = ("z", "p", "contact", "changed", "push", "response_norm", "response_jump")
    return Drive(**{name: torch.from_numpy(np.ascontiguousarray(getattr(states, name), np.float32)) for name in names})


def windows(values: Tensor, cases: Tensor, starts: Tensor, length: int) -> Tensor:
    """`values[cases, starts .. starts + length]`."""
    return values[cases.unsqueeze(1), starts.unsqueeze(1) + torch.arange(length)]


def rollout(model: Correction, drive: Drive, b: Tensor, b_prev: Tensor, limit: Tensor, limits: Limits) -> Tensor:
    """States after each of the `T` steps, `[n, T, r]`, from `b` and `b_prev` at row 0 of the drive."""
    out = []
    for t in range(1, drive.z.shape[1]):
        state = torch.cat(
            [
                b,
                b_prev,
                drive.z[:, t],
                drive.z[:, t - 1],
                drive.p[:, t],
                drive.p[:, t - 1],
                drive.contact[:, t : t + 1],
                drive.contact[:, t - 1 : t],
            ],
            dim=1,
        )
        after, limit = bound(
            model(state),
            limit,
            drive.response_norm[:, t],
            drive.response_jump[:, t],
            drive.changed[:, t],
            limits.relative,
            limits.decay,
        )
        after = after * fade(drive.push[:, t], limits.start_push_mm, limits.end_push_mm).unsqueeze(1)
        b, b_prev = after, b
        out.append(after)
    return torch.stack(out, dim=1)


def true_limits(states: States, limits: Limits) -> np.ndarray:
    """The bound `E` along the true trajectories, `[cases, frames]`: it depends on the drive alone."""
    out = np.zeros(states.contact.shape, np.float32)
    for t in range(1, states.frames):
        grown = limits.decay * (out[:, t - 1] + states.changed[:, t] * states.response_jump[:, t])
        out[:, t] = np.maximum(limits.relative * states.response_norm[:, t], grown)
    return out


@torch.no_grad()
def rollout_from_rest(model: Correction, states: States, limits: Limits) -> np.ndarray:
    """Full autoregressive rollouts of `states`, `[cases, frames, r]`; frame 0 is rest."""
    model.eval()
    zero = torch.zeros(states.cases, model.modes)
    found = rollout(model, drive_of(states), zero, zero, torch.zeros(states.cases), limits)
    return np.concatenate([np.zeros((states.cases, 1, model.modes), np.float32), found.numpy()], axis=1)


def field_mse(states: States, b: np.ndarray) -> np.ndarray:
    """Mean squared error of the field, `[cases, frames]`, mm² (contact nodes not yet overwritten: an upper bound)."""
    true = states.b.astype(np.float64)
    outside = np.maximum(states.residual_square - (true**2).sum(2), 0.0)
    return (outside + ((b - true) ** 2).sum(2)) / float(states.nodes)


def release_frames(states: States, seconds: float = 1.0, dt_s: float = 0.05, least_push_mm: float = 2.0) -> np.ndarray:
    """Frames within `seconds` after contact ends while pushed by `least_push_mm`, `[cases, frames]`."""
    out = np.zeros(states.contact.shape, bool)
    for case, t in np.argwhere(states.contact[:, :-1] & ~states.contact[:, 1:]):
        if states.push[case, t] >= least_push_mm:
            out[case, t + 1 : t + 1 + round(seconds / dt_s)] = True
    return out & ~states.contact & states.valid
