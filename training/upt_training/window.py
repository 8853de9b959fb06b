"""One training window: draw it, roll it, score it. What a prediction is not needed for is not computed.

A window of `S` predictions. The first one of stochastic teacher forcing is not scored (its input is the truth): where
the next input is the truth as well, nothing reads it, and it is skipped. With `scored_rows` the loss is a mean over
rows drawn anew for each prediction, an unbiased estimate of the mean over all rows; nodes that the next prediction
reads are decoded without gradients, and the gradient through time flows through the drawn rows, scaled up to stand for
all. With `drawn_supernodes` a window is encoded with that many of the supernodes, and only nodes that send to these are
read. Validation takes all rows and all supernodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from upt_training.config import Settings
from upt_training.field_cache import FieldCache
from upt_training.replay import ReplayPool, corrupt, truth_state
from upt_training.rollout import State, Stepper, squared_error


@dataclass
class Plan:
    """A window before it is rolled. `forced[i - 1]`: the samples whose input of prediction `i + 1` is the truth.

    The last entry says whether anything reads the last prediction: the replay pool does.
    """

    slots: np.ndarray | None  # of the replay pool
    case: np.ndarray
    frame: np.ndarray
    state: State
    first: int  # the first prediction that is scored, counted from 1
    forced: list[torch.Tensor]


class Windows:
    """Draws windows of the training cases. `generator` chooses cases and frames, `noise` (of the device) is added to
    states, `draw` chooses everything else."""

    def __init__(
        self,
        settings: Settings,
        stepper: Stepper,
        cache: FieldCache,
        pool: ReplayPool | None,
        generator: np.random.Generator,
        draw: torch.Generator,
        noise: torch.Generator,
    ):
        self.settings, self.stepper, self.cache, self.pool = settings, stepper, cache, pool
        self.generator, self.draw, self.noise, self.device = generator, draw, noise, stepper.device
        self.bf16 = settings.train.bf16 and fast_bf16(self.device)

    def plan(self, p: float) -> Plan:
        """Draw where a window starts and where its inputs are the truth, each with probability `p`."""
        t, slots, first = self.settings.train, None, 1
        if self.pool is not None:
            window = t.window
            slots, case, frame, state = self.pool.take(t.micro_batch, window)
            if p > 0:
                state = self.teach(state, case, frame, self.forced(p))
        else:
            window = 2 if t.strategy == "teacher" else t.window
            case = self.generator.integers(self.cache.case_count, size=t.micro_batch)
            frame = self.generator.integers(0, self.cache.frames[case] - window)
            first = 2
            if p >= 1.0:  # the first prediction would be thrown away: start at the second's true input
                frame, first, window = frame + 1, 1, window - 1
            state = truth_state(self.cache, case, frame, self.device)
        forced = [self.forced(p) for _ in range(1, window)]
        forced.append(torch.full((t.micro_batch,), self.pool is None))
        return Plan(slots, case, frame, state, first, forced)

    def forced(self, p: float) -> torch.Tensor:
        """Which samples read the truth."""
        if p <= 0:
            return torch.zeros(self.settings.train.micro_batch, dtype=torch.bool)
        return torch.rand(self.settings.train.micro_batch, generator=self.draw) < p

    def rows(self, count: int) -> torch.Tensor:
        """The rows of `count` that a prediction is scored on."""
        return torch.randperm(count, generator=self.draw)[: self.settings.train.scored_rows].to(self.device)

    def teach(self, state: State, case: np.ndarray, frame: np.ndarray, forced: torch.Tensor) -> State:
        """Replace the state by the truth where `forced`."""
        if not forced.any():
            return state
        truth = truth_state(self.cache, case, frame, self.device)
        forced = forced.to(self.device)[:, None, None]
        u, previous = (
            torch.where(forced, truth.u, state.u),
            torch.where(forced, truth.previous, state.previous),
        )
        return State(u, previous, truth.prior)

    def base(self, state: State, target: dict[str, torch.Tensor]) -> torch.Tensor:
        """What the network adds to: its error is a sample's scale."""
        base = self.settings.model.base
        if base == "prior":
            return target["prior"]
        return state.u.detach() if base == "displacement" else torch.zeros_like(target["u"])

    def loss(self, p: float) -> tuple[torch.Tensor, float]:
        """The loss to minimise, and the MSE in mm² that it stands for. `p`: probability of a true input."""
        return self.score(self.plan(p))

    def score(self, plan: Plan) -> tuple[torch.Tensor, float]:
        tables = self.stepper.tables()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.bf16):
            state, frame, losses, errors = self.roll(plan, tables)
        if plan.slots is not None:
            self.pool.put(plan.slots, frame, state)
        return torch.stack(losses).mean(), float(torch.stack(errors).mean())

    def roll(self, plan: Plan, tables):
        """Predict, score and feed back: the last state and frame, and the loss and MSE of each scored prediction."""
        state, case, frame, first, forced = plan.state, plan.case, plan.frame, plan.first, plan.forced
        t, n = self.settings.train, self.stepper.node_count
        drawn = self.stepper.all if not t.drawn_supernodes else self.stepper.draw(t.drawn_supernodes, self.draw)
        read = drawn.read if self.pool is None else self.stepper.all.read  # the pool's next window draws anew
        losses, errors = [], []
        for i in range(1, len(forced) + 1):
            if i > 1:
                state = self.teach(state, case, frame, forced[i - 2])
            frame = frame + 1
            part, readers = np.arange(len(case)), (~forced[i - 1]).nonzero()[:, 0]
            if i < first:  # where the truth is read next nothing needs this prediction
                part, readers = part[readers.numpy()], torch.arange(len(readers))
                if len(part) == 0:
                    continue
                state = state.part(part)
            target = {k: v.to(self.device) for k, v in self.cache.fields(case[part], frame[part]).items()}
            if t.corrupt_contact > 0 or t.input_noise_mm > 0:
                state = corrupt(state, target["contact"], t.corrupt_contact, t.input_noise_mm, self.draw, self.noise)
            base, rows = self.base(state, target), self.rows(n) if 0 < t.scored_rows < n else None
            scored = None if rows is None else (rows, read, readers.to(self.device))
            state = self.stepper.step(state, target, tables, scored, drawn)
            if i >= first:
                found, truth = (state.u, target["u"]) if rows is None else (state.u[:, rows], target["u"][:, rows])
                error = squared_error(found, truth)
                errors.append(error.detach().mean())
                if t.balance_mm2 > 0:
                    error = error * t.balance_mm2 / (t.balance_mm2 + squared_error(base, target["u"]))
                losses.append(error.mean())
            if rows is not None and i < len(forced):
                state = State(scaled_gradient(state.u, n / len(rows)), state.previous, state.prior)
            if len(part) < len(case):
                state = state.among(part, len(case))
        return state, frame, losses, errors


def scaled_gradient(x: torch.Tensor, factor: float) -> torch.Tensor:
    """`x`, whose gradient is multiplied by `factor`."""
    value = x.detach()
    return value + factor * (x - value)


def fast_bf16(device: torch.device) -> bool:
    """Whether products of bfloat16 are faster than of float32: GPUs, and CPUs with AMX or `vdpbf16ps`."""
    if device.type != "cpu":
        return True
    capabilities = getattr(torch.cpu, "get_capabilities", dict)()
    return any(capabilities.get(name, False) for name in ("amx_bf16", "avx512_bf16"))
