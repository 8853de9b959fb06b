"""Where training windows start: at the truth (stochastic teacher forcing) or at the model's own states (replay pool).

The pool holds rollouts in progress. A window continues some of them, is scored against the truth and puts its last
state back, so every prediction serves as training sample and as the next input, and the inputs are those of inference.
"""

from __future__ import annotations

import numpy as np
import torch

from upt_training.rollout import State


def truth_state(cache, case: np.ndarray, frame: np.ndarray, device) -> State:
    """The true state at `frame` (0 is rest)."""
    now, before = cache.fields(case, frame), cache.fields(case, frame - 1)
    prior = now["prior"].to(device) if "prior" in now else None
    return State(now["u"].to(device), before["u"].to(device), prior)


class ReplayPool:
    """`slots` rollouts: case, frame, and the state there, on `device`."""

    def __init__(self, cache, slots: int, generator: np.random.Generator, device: torch.device):
        n = len(cache.nodes)
        self.cache, self.generator, self.device = cache, generator, device
        self.case = generator.integers(cache.case_count, size=slots)
        self.frame = generator.integers(0, cache.frames[self.case] - 1)
        start = truth_state(cache, self.case, self.frame, device)
        self.u, self.previous = start.u.clone(), start.previous.clone()
        self.next = 0
        assert self.u.shape == (slots, n, 3)

    def take(self, batch: int, window: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, State]:
        """Slots, cases, frames and states of the next `batch` rollouts; finished ones restart, most at rest."""
        slots = (self.next + np.arange(batch)) % len(self.case)
        self.next = int((self.next + batch) % len(self.case))
        lost = ~torch.isfinite(self.u[slots]).flatten(1).all(dim=1).cpu().numpy()
        for s in slots[lost | (self.frame[slots] + window >= self.cache.frames[self.case[slots]])]:
            case = int(self.generator.integers(self.cache.case_count))
            late = int(self.generator.integers(0, self.cache.frames[case] - window - 1))
            frame = 0 if self.generator.random() < 0.7 else late
            state = truth_state(self.cache, np.array([case]), np.array([frame]), self.device)
            self.case[s], self.frame[s] = case, frame
            self.u[s], self.previous[s] = state.u[0], state.previous[0]
        state = State(self.u[slots], self.previous[slots], None)
        if self.cache.prior is not None:
            state.prior = self.cache.fields(self.case[slots], self.frame[slots])["prior"].to(self.device)
        return slots, self.case[slots].copy(), self.frame[slots].copy(), state

    def put(self, slots: np.ndarray, frame: np.ndarray, state: State) -> None:
        self.frame[slots] = frame
        self.u[slots] = state.u.detach()
        self.previous[slots] = state.previous.detach()

    def state_dict(self) -> dict:
        return {
            "case": torch.from_numpy(self.case),
            "frame": torch.from_numpy(self.frame),
            "u": self.u.cpu(),
            "previous": self.previous.cpu(),
            "next": self.next,
        }

    def load_state_dict(self, values: dict) -> None:
        self.case, self.frame, self.next = values["case"].numpy(), values["frame"].numpy(), values["next"]
        self.u, self.previous = values["u"].to(self.device), values["previous"].to(self.device)


def corrupt(
    state: State,
    contact: torch.Tensor,
    probability: float,
    noise_mm: float,
    draw: torch.Generator,
    noise: torch.Generator,
) -> State:
    """Corrupted states while in contact, so that the contact and not a copy of the state decides.

    With `probability` a sample in contact has its deviation from the response (or the state itself, without a prior)
    scaled by a random factor in [0, 2]; all samples get white noise of `noise_mm`. `draw` is a generator of the CPU,
    `noise` one of the state's device.
    """
    batch, device = len(state.u), state.u.device
    u, previous = state.u, state.previous
    if probability > 0:
        touched = (contact.amax(dim=(1, 2)) > 0).cpu()
        chosen = (torch.rand(batch, generator=draw) < probability) & touched
        factor = torch.where(chosen, 2.0 * torch.rand(batch, generator=draw), torch.ones(batch))
        change = (factor - 1.0).to(device)[:, None, None] * (u - state.prior if state.prior is not None else u)
        u, previous = u + change, previous + change
    if noise_mm > 0:
        u = u + noise_mm * torch.randn(u.shape, generator=noise, device=device)
        previous = previous + noise_mm * torch.randn(u.shape, generator=noise, device=device)
    return State(u, previous, state.prior)
