"""`python -m upt_training bench`: the cost of a training step before and after each lever, and the error of gradients.

The plain path makes every prediction of a window, over padded rows of messages, and decodes and scores every node; the
levers are then added one after another: those that change no gradient, then those that the configuration asks for
(`scored_rows`, `drawn_supernodes`, `bf16`, `resident_gb`). Times are CPU seconds of one thread, of the same windows at
evenly spaced places of the schedule, each the fastest of the rounds. Gradients are of one step without drop path.
"""

from __future__ import annotations

import copy
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from upt_training.config import Settings, load_settings
from upt_training.errors import InputError
from upt_training.memory import keep_freed_memory
from upt_training.page import write_table
from upt_training.replay import ReplayPool
from upt_training.rollout import State, squared_error
from upt_training.run import find_mesh, make_trainer, open_prior
from upt_training.trainer import POOL_SLOTS, Trainer
from upt_training.window import Plan, Windows, fast_bf16

HEAD = (
    "| each row adds | samples a step | CPU s | samples a core-second | times the plain path | "
    "error of the gradient, relative | of the mean of {draws} |"
)


@dataclass
class Lever:
    name: str
    settings: dict = field(default_factory=dict)  # values of `[train]`
    flat: bool = True  # messages on the edges that there are
    lazy: bool = True  # predictions that nothing reads are skipped
    fused: bool = True
    keeps: bool = False  # freed memory; for the rest of the process


def levers(settings: Settings) -> list[Lever]:
    """The plain path, then one lever more in each row."""
    t, off = settings.train, {"scored_rows": 0, "drawn_supernodes": 0, "bf16": False, "resident_gb": 0.0}
    off |= {"micro_batch": 1, "accumulate": t.micro_batch * t.accumulate}
    out = [
        Lever("plain path", dict(off), flat=False, lazy=False, fused=False),
        Lever("messages on the edges that there are", dict(off), lazy=False, fused=False),
        Lever("predictions that nothing reads are skipped", dict(off), fused=False),
    ]
    names = {
        "scored_rows": f"{t.scored_rows} nodes scored, those that are read decoded without gradients",
        "drawn_supernodes": f"{t.drawn_supernodes} of {settings.model.graph.supernodes} supernodes drawn a window",
        "bf16": "bfloat16 products" + ("" if fast_bf16(torch.device("cpu")) else " (not fast on this CPU: float32)"),
        "resident_gb": "cases in memory, read by one gather",
    }
    for key, name in names.items():
        if getattr(t, key):
            off[key] = getattr(t, key)
            out.append(Lever(name, dict(off), fused=False))
    if t.micro_batch > 1:
        off |= {"micro_batch": t.micro_batch, "accumulate": t.accumulate}
        out.append(Lever(f"{t.micro_batch} windows in one batch", dict(off), fused=False))
    if t.optimiser == "adamw":
        out.append(Lever("fused AdamW", dict(off)))
    out.append(Lever("freed memory stays with the process", dict(off), keeps=True))
    return out


class PlainWindows(Windows):
    """Every prediction of a window is made and back-propagated through, whether anything reads it or not."""

    def roll(self, plan, tables):
        state, case, frame, first, forced = plan.state, plan.case, plan.frame, plan.first, plan.forced
        losses, errors = [], []
        for i in range(1, len(forced) + 1):
            if i > 1:
                state = self.teach(state, case, frame, forced[i - 2])
            frame = frame + 1
            target = {k: v.to(self.device) for k, v in self.cache.fields(case, frame).items()}
            base = self.base(state, target)
            state = self.stepper.step(state, target, tables)
            if i >= first:
                error = squared_error(state.u, target["u"])
                errors.append(error.detach().mean())
                t = self.settings.train
                if t.balance_mm2 > 0:
                    error = error * t.balance_mm2 / (t.balance_mm2 + squared_error(base, target["u"]))
                losses.append(error.mean())
        return state, frame, losses, errors


def trainer_of(lever: Lever, settings: Settings, options, mesh, table, folder: Path) -> Trainer:
    """A trainer of the configuration with this lever's settings; corrupted states and noise are left out."""
    settings = copy.deepcopy(settings)
    for key, value in {**lever.settings, "corrupt_contact": 0.0, "input_noise_mm": 0.0}.items():
        setattr(settings.train, key, value)
    trainer = make_trainer(settings, options.data, mesh, table, folder, "cpu")
    if options.init:
        trainer.start_from(options.init)
    if not lever.flat:
        trainer.model.padded = True
    if not lever.lazy:
        w = trainer.windows
        trainer.windows = PlainWindows(w.settings, w.stepper, w.cache, w.pool, w.generator, w.draw, w.noise)
    if not lever.fused and settings.train.optimiser == "adamw":
        for group in trainer.optimiser.param_groups:
            group["fused"] = None
    return trainer


def reseed(trainer: Trainer, window: int) -> None:
    """The same windows for every lever."""
    trainer.generator.bit_generator.state = np.random.PCG64([window]).state
    trainer.draw.manual_seed(window)
    torch.manual_seed(window)
    if trainer.pool is not None:
        trainer.pool = ReplayPool(trainer.train_cache, POOL_SLOTS, trainer.generator, trainer.device)
        trainer.windows.pool = trainer.pool


def seconds_a_step(trainer: Trainer, steps: int, rounds: int) -> float:
    """CPU seconds, averaged over `steps` places of the schedule, each the fastest of the rounds."""
    best = np.full(steps, np.inf)
    for _ in range(rounds):
        for i in range(steps):
            reseed(trainer, i)
            trainer.step_count = int((i + 0.5) / steps * trainer.total_steps)
            began = time.process_time()
            trainer.train_step()
            best[i] = min(best[i], time.process_time() - began)
    return float(best.mean())


def gradient(trainer: Trainer, draw: int) -> torch.Tensor:
    """Of the windows of a step with half of the inputs true, in evaluation mode (no drop path)."""
    reseed(trainer, 1)
    trainer.model.eval()
    trainer.optimiser.zero_grad(set_to_none=True)
    t = trainer.settings.train
    batch, accumulate = t.micro_batch, t.accumulate
    t.micro_batch = 1
    plans = [trainer.windows.plan(0.5) for _ in range(batch * accumulate)]  # the same whatever the batch
    t.micro_batch = batch
    trainer.draw.manual_seed(draw)  # rows and supernodes
    for i in range(accumulate):
        plan = joined(plans[i * batch : (i + 1) * batch])
        (trainer.windows.score(plan)[0] / accumulate).backward()
    return torch.cat([p.grad.flatten() for p in trainer.model.parameters()])


def joined(plans: list[Plan]) -> Plan:
    """Single windows as one batch."""
    states = [plan.state for plan in plans]
    prior = None if states[0].prior is None else torch.cat([state.prior for state in states])
    state = State(torch.cat([s.u for s in states]), torch.cat([s.previous for s in states]), prior)
    slots = None if plans[0].slots is None else np.concatenate([plan.slots for plan in plans])
    case, frame = (np.concatenate([getattr(plan, name) for plan in plans]) for name in ("case", "frame"))
    forced = [torch.cat(parts) for parts in zip(*(plan.forced for plan in plans), strict=True)]
    return Plan(slots, case, frame, state, plans[0].first, forced)


def bench_command(options) -> int:
    torch.set_num_threads(1)
    settings, mesh = load_settings(options.config), find_mesh(options.mesh, options.data)
    for name in ("steps", "rounds", "draws"):
        if getattr(options, name) < 1:
            raise InputError(f"--{name}: must be at least 1")
    table = open_prior(settings.model, mesh, options.prior, options.vibration)
    samples = settings.train.samples_per_step
    lines, plain, first = [HEAD.format(draws=options.draws), "|---|---|---|---|---|---|---|"], None, 0.0
    with tempfile.TemporaryDirectory() as folder:
        for lever in levers(settings):
            if lever.keeps and not keep_freed_memory():
                print(f"{lever.name}: left out, the C library is not glibc", flush=True)
                continue
            trainer = trainer_of(lever, settings, options, mesh, table, Path(folder))
            random = bool(lever.settings["scored_rows"] or lever.settings["drawn_supernodes"])
            found = [gradient(trainer, draw) for draw in range(options.draws if random else 1)]
            plain = found[0] if plain is None else plain
            one = np.mean([float((g - plain).norm() / plain.norm()) for g in found])
            mean = float((torch.stack(found).mean(0) - plain).norm() / plain.norm())
            seconds = seconds_a_step(trainer, options.steps, options.rounds)
            first = first or seconds
            cells = [lever.name, str(samples)]
            cells += [f"{seconds:.2f}", f"{samples / seconds:.2f}", f"{first / seconds:.1f}"]
            cells += ["-" if len(lines) == 2 else f"{one:.1e}", f"{mean:.1e}" if random else "-"]
            lines.append("| " + " | ".join(cells) + " |")
            print(lines[-1], flush=True)
    if options.page:
        write_table(options.page, f"bench {settings.name}", lines)
    return 0
