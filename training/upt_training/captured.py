"""A window's gradient as one CUDA graph, for stochastic and pure teacher forcing.

A step of the `paper` configuration is thousands of small kernels, whose launches take longer than the kernels. Here the
forward and the backward pass of a window have fixed shapes: every prediction is made for every sample, a mask says
where the truth is its input, messages go over padded rows, and nodes that the next prediction reads are all nodes. So
they are captured once and replayed; what a window reads is copied into one buffer beforehand. The gradient is that of
`Windows.loss`.
"""

from __future__ import annotations

import numpy as np
import torch

from upt_training.errors import InputError
from upt_training.rollout import State, squared_error
from upt_training.window import Windows, scaled_gradient

WARM_UP = 3  # passes before the capture: libraries choose their kernels in them
SAME = 0.05  # of a gradient: bfloat16 and atomic sums differ from run to run


class CapturedWindows:
    """Gradients of windows of one `Windows`; with `capture` as a graph, without kernel by kernel (any device)."""

    def __init__(self, windows: Windows, scale: float, capture: bool):
        t, model = windows.settings.train, windows.stepper.model
        refused = {
            "strategy": windows.pool is not None,
            "accumulate": t.accumulate != 1,
            "corrupt_contact or input_noise_mm": t.corrupt_contact > 0 or t.input_noise_mm > 0,
            "balance_mm2": t.balance_mm2 > 0,
            "resident_gb": "u" not in windows.cache.resident,
            "features": model.settings.uses_prior,
        }
        for name, wrong in refused.items():
            if wrong:
                raise InputError(
                    f"train.cuda_graph does not go with this {name}: it takes stf and teacher with accumulate 1, "
                    "without noise, balance and linear response, on cases that fit resident_gb; leave it out"
                )
        self.windows, self.scale, self.model = windows, scale, model
        self.parameters = list(model.parameters())
        self.predictions = 1 if t.strategy == "teacher" else t.window
        self.first = 0 if t.strategy == "teacher" else 1  # the first prediction that is scored, counted from 0
        stepper, device, batch = windows.stepper, windows.device, t.micro_batch
        n, some = stepper.node_count, len(stepper.all.supernodes)
        self.scored = t.scored_rows if 0 < t.scored_rows < n else 0
        self.drawn = min(t.drawn_supernodes or some, some)
        sizes = [batch, batch, self.predictions * batch, (self.predictions - 1) * batch, self.drawn]
        sizes.append(self.predictions * self.scored)
        self.host = torch.zeros(sum(sizes), dtype=torch.int64, pin_memory=device.type == "cuda")
        self.inputs = torch.zeros(sum(sizes), dtype=torch.int64, device=device)
        parts = self.inputs.split(sizes)
        self.start, self.before = parts[0], parts[1]
        self.targets, self.forced = (part.view(-1, batch) for part in parts[2:4])
        self.supernodes, self.rows = parts[4], parts[5].view(self.predictions, -1)
        self.every = torch.arange(n, device=device)
        self.samples = torch.arange(batch, device=device)
        self.graph, self.result = None, None
        if capture:
            self.capture()

    # -- what a window reads ------------------------------------------------------------------------------------

    def draw(self, p: float) -> None:
        """Choose cases, frames, true inputs (each with probability `p`), supernodes and scored rows."""
        w, t = self.windows, self.windows.settings.train
        cache, window = w.cache, max(2, self.predictions)
        case = w.generator.integers(cache.case_count, size=t.micro_batch)
        frame = w.generator.integers(0, cache.frames[case] - window) + (1 - self.first)
        forced = [w.forced(p).long() for _ in range(1, self.predictions)]
        count = len(w.stepper.all.supernodes)
        every = torch.arange(count)
        drawn = every if self.drawn == count else torch.randperm(count, generator=w.draw)[: self.drawn].sort().values

        def rows(at: np.ndarray) -> torch.Tensor:
            return torch.from_numpy(cache.starts[case] + np.clip(at, 0, cache.frames[case] - 1))

        targets = [rows(frame + i) for i in range(1, self.predictions + 1)]
        nodes = w.stepper.node_count
        scored = [torch.randperm(nodes, generator=w.draw)[: self.scored] for _ in range(self.predictions)]
        torch.cat([rows(frame), rows(frame - 1), *targets, *forced, drawn, *scored], out=self.host)
        self.inputs.copy_(self.host, non_blocking=True)

    # -- the passes ---------------------------------------------------------------------------------------------

    def truth(self, rows: torch.Tensor) -> torch.Tensor:
        return self.windows.cache.resident["u"].index_select(0, rows).float()

    def roll(self) -> tuple[torch.Tensor, torch.Tensor]:
        """The loss of the window in the buffer, and its MSE in mm²."""
        stepper = self.windows.stepper
        tables, n, last = stepper.tables(), stepper.node_count, self.predictions - 1
        encoded = stepper.all._replace(
            neighbours=stepper.all.neighbours.index_select(0, self.supernodes),
            mask=stepper.all.mask.index_select(0, self.supernodes),
            supernodes=stepper.all.supernodes.index_select(0, self.supernodes),
        )
        true, errors = [self.truth(self.before), self.truth(self.start)], []
        state = State(true[1], true[0], None)
        for i in range(self.predictions):
            if i > 0:
                forced = self.forced[i - 1][:, None, None] > 0
                u, previous = torch.where(forced, true[-1], state.u), torch.where(forced, true[-2], state.previous)
                state = State(u, previous, None)
            true.append(self.truth(self.targets[i]))
            contact = self.windows.cache.resident["contact"].index_select(0, self.targets[i]).float()[..., None]
            target = {"u": true[-1], "contact": contact, "c": true[-1] * contact}
            rows, scored = None, None
            if self.scored:
                rows = self.rows[i]
                scored = (rows, self.every, self.samples if i < last else self.samples[:0])
            state = stepper.step(state, target, tables, scored, encoded)
            if i >= self.first:
                found, wanted = state.u, target["u"]
                if rows is not None:
                    found, wanted = found.index_select(1, rows), wanted.index_select(1, rows)
                errors.append(squared_error(found, wanted).mean())
            if rows is not None and i < last:
                state = State(scaled_gradient(state.u, n / self.scored), state.previous, None)
        loss = torch.stack(errors).mean()
        return loss * self.scale, loss.detach()

    def backward(self) -> tuple[torch.Tensor, tuple[torch.Tensor, ...]]:
        """MSE and gradients of the window in the buffer."""
        padded, self.model.padded = self.model.padded, True
        try:
            with torch.autocast(self.windows.device.type, torch.bfloat16, enabled=self.windows.bf16):
                loss, mse = self.roll()
            # Optimisers ask for gradients laid out like the parameters.
            return mse, tuple(g.contiguous() for g in torch.autograd.grad(loss, self.parameters))
        finally:
            self.model.padded = padded

    def capture(self) -> None:
        """Record both passes; a replay that has another gradient than the passes themselves is a `RuntimeError`."""
        w = self.windows
        chosen, drawn = w.generator.bit_generator.state, w.draw.get_state()
        self.draw(1.0)
        w.generator.bit_generator.state = chosen
        w.draw.set_state(drawn)
        here, side = torch.cuda.current_stream(), torch.cuda.Stream()
        side.wait_stream(here)
        with torch.cuda.stream(side):
            for _ in range(WARM_UP):
                plain = self.backward()[1]
        here.wait_stream(side)
        self.graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(self.graph):
            self.result = self.backward()
        self.graph.replay()
        if self.model.settings.drop_path > 0:  # each pass drops other branches
            return
        plain = torch.cat([g.flatten() for g in plain])
        replayed = torch.cat([g.flatten() for g in self.result[1]])
        error = float((replayed - plain).norm() / plain.norm())
        if not error < SAME:
            raise RuntimeError(f"the CUDA graph has another gradient ({error} off); set train.cuda_graph = false")

    def step(self, p: float) -> float:
        """Draw a window and leave its gradient in the parameters; the MSE in mm²."""
        self.draw(p)
        if self.graph is not None:
            self.graph.replay()
        mse, gradients = self.backward() if self.graph is None else self.result
        for parameter, gradient in zip(self.parameters, gradients, strict=True):
            parameter.grad = gradient
        return float(mse)
