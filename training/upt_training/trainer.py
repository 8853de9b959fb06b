"""The training loop: stochastic teacher forcing (paper, Eq. STF), pure teacher forcing, or replay of own states.

A window of `S` predictions; before each but the first the input is the truth with probability `p`, which falls
linearly from 1 to 0 over the first `epochs` and is 0 in the `autoregressive_epochs`. Back-propagation through time;
the first prediction is excluded from the loss (its input is the truth). Loss in mm² over the subset's nodes.
"""

from __future__ import annotations

import copy
import csv
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
import torch.distributed as distributed

from upt_training.bundle_weights import bundle_state
from upt_training.captured import CapturedWindows
from upt_training.config import Settings
from upt_training.errors import InputError
from upt_training.field_cache import FieldCache
from upt_training.model import Upt, load_state
from upt_training.optimiser import learning_rate, make_optimiser
from upt_training.replay import ReplayPool
from upt_training.rollout import Stepper, autoregressive_scores, cache_rollout
from upt_training.window import Windows

POOL_SLOTS = 64
POOL_BATCHES = 4  # rollouts in the pool are as many as this number of batches, and POOL_SLOTS at least


class Trainer:
    """Owns model, optimiser, random state and the run folder (`last.pt`, `best.pt`, `log.csv`)."""

    def __init__(
        self,
        settings: Settings,
        folder: Path,
        mesh,
        graph,
        train: FieldCache,
        test: FieldCache,
        boundary,
        device,
    ):
        self.settings, self.folder, self.device = settings, Path(folder), torch.device(device)
        self.mesh, self.boundary = mesh, boundary
        self.train_cache, self.test_cache = train, test
        t = settings.train
        if t.resident_gb > 0:
            train.hold(t.resident_gb, self.device)
        torch.manual_seed(t.seed)
        self.model = Upt(settings.model)
        if t.scaled_start:
            self.model.scale_start()
        self.model.set_coordinates(mesh.positions)
        self.model.set_normalisation(*normalisation(train, settings.model))
        self.model.to(self.device)
        self.ema = copy.deepcopy(self.model).requires_grad_(False) if t.ema > 0 else None
        self.stepper = Stepper(self.model, mesh, graph, train.nodes, boundary, t.exact_boundary, device)
        self.optimiser = make_optimiser(t, self.model)
        self.world = distributed.get_world_size() if distributed.is_initialized() else 1
        self.rank = distributed.get_rank() if distributed.is_initialized() else 0
        self.generator = np.random.default_rng([t.seed, self.rank])
        self.draw = torch.Generator().manual_seed(t.seed + 7919 * self.rank)
        if self.rank > 0:  # drop path differs too
            torch.manual_seed(t.seed + 7919 * self.rank)
        # Noise is drawn where the state lies: copies of it would take longer than the step of a GPU.
        self.noise = self.draw
        if self.device.type != "cpu":
            self.noise = torch.Generator(self.device).manual_seed(t.seed + 7919 * self.rank)
        slots = max(POOL_SLOTS, POOL_BATCHES * t.micro_batch)
        self.pool = ReplayPool(train, slots, self.generator, self.device) if t.strategy == "replay" else None
        self.windows = Windows(settings, self.stepper, train, self.pool, self.generator, self.draw, self.noise)
        self.captured: CapturedWindows | None = None
        self.rollouts: dict[str, np.ndarray] = {}  # of the last evaluation: errors by case and step
        self.slice: tuple[float, float] | None = None  # where the clock leads the schedule: its start and its seconds
        self.step_count, self.best, self.stale = 0, float("inf"), 0
        self.core_seconds = 0.0  # CPU time of this process in training steps, over all resumed parts
        self.loss_scale = 1.0 / float((self.model.output_scale**2).sum())
        windows = int((train.frames - 1).sum()) // max(1, t.window)
        self.steps_per_epoch = t.steps_per_epoch or max(1, windows // (t.micro_batch * t.accumulate * self.world))
        self.total_steps = self.steps_per_epoch * (t.epochs + t.autoregressive_epochs)

    # -- one step -----------------------------------------------------------------------------------------------

    def teacher_probability(self) -> float:
        t = self.settings.train
        if t.strategy == "teacher":
            return 1.0
        return max(0.0, 1.0 - self.epoch() / max(1, t.epochs))

    def epoch(self) -> float:
        """How far the schedule is, by steps, or by the clock where it fills a slice of time (`fit`)."""
        if self.slice is None:
            return self.step_count / self.steps_per_epoch
        t, (began, seconds) = self.settings.train, self.slice
        return (t.epochs + t.autoregressive_epochs) * min(1.0, (time.monotonic() - began) / seconds)

    def train_step(self) -> tuple[float, float]:
        """One optimiser step over `accumulate` windows: mean loss in mm² and the gradient norm before clipping."""
        t, began = self.settings.train, time.process_time()
        rate = learning_rate(t, self.epoch())
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        self.model.train()
        self.optimiser.zero_grad(set_to_none=True)
        p, total = self.teacher_probability(), 0.0
        if t.cuda_graph and self.device.type == "cuda":
            if self.captured is None:
                self.captured = CapturedWindows(self.windows, self.loss_scale, capture=True)
            total = self.captured.step(p)
        for _ in range(t.accumulate if self.captured is None else 0):
            loss, mse = self.windows.loss(p)
            (loss * self.loss_scale / t.accumulate).backward()
            total += mse / t.accumulate
        if self.world > 1:
            for parameter in self.model.parameters():
                distributed.all_reduce(parameter.grad)
                parameter.grad /= self.world
        norm = float(torch.nn.utils.clip_grad_norm_(self.model.parameters(), t.clip))
        if np.isfinite(total) and np.isfinite(norm):
            self.optimiser.step()
        self.step_count += 1
        if self.ema is not None:
            decay = min(t.ema, (1 + self.step_count) / (10 + self.step_count))
            with torch.no_grad():
                torch._foreach_lerp_(list(self.ema.parameters()), list(self.model.parameters()), 1.0 - decay)
        self.core_seconds += time.process_time() - began
        return total, norm

    # -- evaluation and files -----------------------------------------------------------------------------------

    def evaluate(self) -> dict[str, float]:
        """Autoregressive scores of the held-out cases, with the averaged weights where there are any."""
        count = min(self.settings.train.evaluate_cases, self.test_cache.case_count)
        cases = np.unique(np.linspace(0, self.test_cache.case_count - 1, count).round().astype(int))
        self.stepper.model = self.ema if self.ema is not None else self.model
        self.rollouts = cache_rollout(self.stepper, self.test_cache, cases)
        self.stepper.model = self.model
        return autoregressive_scores(self.rollouts)

    def fit(
        self, max_minutes: float = 0.0, report=print, checkpoint_minutes: float = 0.0, evaluate_minutes: float = 0.0
    ) -> str:
        """Train to the end, to early stopping or to the time limit; returns which. Resumes exactly from `last.pt`.

        `last.pt` is written at each evaluation, at the end, and every `checkpoint_minutes` if that is above 0. With
        `evaluate_minutes` above 0 the clock leads: the schedule fills `max_minutes` however many steps that makes,
        and evaluations come after so many minutes and at the end.
        """
        t, began, first = self.settings.train, time.monotonic(), self.step_count
        saved = evaluated = began
        if evaluate_minutes > 0:
            self.slice, self.total_steps = (began, 60.0 * max_minutes), 10**9
        running, norms, spoken = [], [], time.monotonic()
        while self.step_count < self.total_steps:
            loss, norm = self.train_step()
            running.append(loss)
            norms.append(norm)
            elapsed = time.monotonic() - began
            if time.monotonic() - spoken > 30 and self.rank == 0:
                spoken = time.monotonic()
                left = elapsed / (self.step_count - first) * (self.total_steps - self.step_count)
                report(f"step {self.step_count}/{self.total_steps} loss {np.mean(running[-200:]):.4f} mm², "
                       f"{left / 60:.0f} min left", flush=True)  # fmt: skip
            ended = bool(max_minutes) and self._any_process(elapsed > 60 * max_minutes)
            due = self.step_count % (self.steps_per_epoch * t.evaluate_every) == 0
            if evaluate_minutes > 0:
                due = ended or time.monotonic() - evaluated > 60 * evaluate_minutes
            if due or self.step_count == self.total_steps:
                if self._evaluate_and_save(running, norms, elapsed, report):
                    return "stopped early"
                running, norms, saved = [], [], time.monotonic()
                evaluated = saved
            elif checkpoint_minutes and time.monotonic() - saved > 60 * checkpoint_minutes:
                self.save("last.pt")
                saved = time.monotonic()
            if ended:
                self.save("last.pt")
                return "time limit"
        return "finished"

    def _any_process(self, here: bool) -> bool:
        """True in all processes if it is true in one: they must leave the loop at the same step."""
        if self.world == 1:
            return here
        flag = torch.tensor(float(here), device=self.device)
        distributed.all_reduce(flag)
        return bool(flag > 0)

    def _evaluate_and_save(self, running, norms, elapsed, report) -> bool:
        t = self.settings.train
        scores = self.evaluate()
        row = {
            "step": self.step_count,
            "epoch": round(self.epoch(), 3),
            "teacher_probability": round(self.teacher_probability(), 4),
            "learning_rate": learning_rate(t, self.epoch()),
            "train_mse_mm2": float(np.mean(running)) if running else float("nan"),
            "max_gradient_norm": float(np.max(norms)) if norms else float("nan"),
            **{f"test_{k}": v for k, v in scores.items()},
            "seconds": round(elapsed, 1),
            "core_hours": round(self.core_seconds / 3600, 4),
        }
        better = scores["mse_mm2"] < self.best
        self.best, self.stale = (scores["mse_mm2"], 0) if better else (self.best, self.stale + 1)
        if self.rank == 0:
            report(" ".join(f"{k}={v:.5g}" for k, v in row.items()), flush=True)
            self._log(row)
            if better:
                self.save("best.pt")
            self.save("last.pt")
        return bool(t.patience) and self.stale >= t.patience

    def _log(self, row: dict) -> None:
        path = self.folder / "log.csv"
        new = not path.exists()
        with path.open("a", newline="") as file:
            writer = csv.DictWriter(file, row.keys())
            if new:
                writer.writeheader()
            writer.writerow(row)

    def save(self, name: str) -> None:
        """Everything that a resumed run needs to be the same run, written beside and moved into place."""
        if self.rank != 0:
            return
        state = {
            "format": "upt-checkpoint",
            "settings": self.settings.to_dict(),
            "model_hash": self.settings.model_hash(),
            "mesh_sha256": self.mesh.sha256,
            "boundary": self.boundary,
            "model": self.model.state_dict(),
            "ema": self.ema.state_dict() if self.ema is not None else None,
            "optimiser": self.optimiser.state_dict(),
            "pool": self.pool.state_dict() if self.pool is not None and name == "last.pt" else None,
            "random": {
                "torch": torch.get_rng_state(),
                "device": torch.cuda.get_rng_state(self.device) if self.device.type == "cuda" else None,
                "draw": self.draw.get_state(),
                "noise": self.noise.get_state(),
                "numpy": self.generator.bit_generator.state,
            },
            "step_count": self.step_count,
            "core_seconds": self.core_seconds,
            "best": float(self.best),
            "stale": self.stale,
        }
        torch.save(state, self.folder / (name + ".tmp"))
        (self.folder / (name + ".tmp")).rename(self.folder / name)

    def resume(self, path: Path) -> None:
        """Continue from `last.pt` of the same configuration, exactly in one process.

        The file holds the first process's random state and pool; the others start on draws of their own.
        """
        state = load_checkpoint(path)
        if state["model_hash"] != self.settings.model_hash():
            raise InputError(f"{path}: checkpoint of another configuration; resume with the one in its run folder")
        if state["mesh_sha256"] != self.mesh.sha256:
            raise InputError(f"{path}: checkpoint of another mesh; start a new run with --init {path}")
        load_state(self.model, state["model"], str(path))
        if self.ema is not None and state["ema"] is not None:
            load_state(self.ema, state["ema"], str(path))
        self.optimiser.load_state_dict(state["optimiser"])
        self.step_count, self.best, self.stale = state["step_count"], state["best"], state["stale"]
        self.core_seconds = state.get("core_seconds", 0.0)
        if self.rank > 0:
            seeds = np.random.SeedSequence([self.settings.train.seed, self.rank, self.step_count])
            self.generator.bit_generator.state = np.random.PCG64(seeds).state
            self.draw.manual_seed(int(seeds.generate_state(1)[0]))
            torch.manual_seed(int(seeds.generate_state(2)[1]))
            return
        if self.pool is not None and state["pool"] is not None:
            self.pool.load_state_dict(state["pool"])
        torch.set_rng_state(state["random"]["torch"])
        self.draw.set_state(state["random"]["draw"])
        if self.device.type == "cuda" and state["random"].get("device") is not None:
            torch.cuda.set_rng_state(state["random"]["device"], self.device)
            self.noise.set_state(state["random"]["noise"])
        self.generator.bit_generator.state = state["random"]["numpy"]

    def start_from(self, path: Path) -> None:
        """Take the weights (and the normalisation) of another run or bundle, for transfer to another mesh or recipe."""
        if Path(path).is_dir():
            weights = bundle_state(path, self.model)
        else:
            state = load_checkpoint(path)
            weights = state["ema"] or state["model"]
        load_state(self.model, weights, str(path))
        if self.ema is not None:
            load_state(self.ema, weights, str(path))
        self.loss_scale = 1.0 / float((self.model.output_scale**2).sum())


def normalisation(cache: FieldCache, model) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Per-axis mean and std of `u`, std of what the network adds to its base, and the mixing scale."""
    cases = np.unique(np.linspace(0, cache.case_count - 1, min(40, cache.case_count)).astype(int))

    def read(arrays: list[np.ndarray], case: int) -> np.ndarray:
        return arrays[case][::2].astype(np.float64)

    mean, std = spread(read(cache.displacement, c) for c in cases)
    if model.base == "displacement":
        out = spread(np.diff(cache.displacement[c].astype(np.float64), axis=0) for c in cases)[1]
    elif model.base == "prior":
        out = spread(read(cache.displacement, c) - read(cache.prior, c) for c in cases)[1]
    else:
        out = std
    scale = float(np.clip(std.mean() / max(1e-6, out.mean()), 1.0, 5.0))
    return mean.astype(np.float32), *(np.maximum(s, 1e-6).astype(np.float32) for s in (std, out)), scale


def spread(fields: Iterable[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of each axis of `[..., 3]` f64 arrays, one of them in memory at a time."""
    count, total, squares = 0, np.zeros(3), np.zeros(3)
    for field in fields:
        rows = field.reshape(-1, 3)
        count, total, squares = count + len(rows), total + rows.sum(axis=0), squares + (rows**2).sum(axis=0)
    mean = total / count
    return mean, np.sqrt(np.maximum(squares / count - mean**2, 0.0))


def load_checkpoint(path: Path) -> dict:
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such checkpoint")
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:
        raise InputError(f"{path}: not a readable checkpoint ({error}); use the one before it") from error
    if not isinstance(state, dict) or state.get("format") != "upt-checkpoint":
        raise InputError(f"{path}: not a checkpoint of this package")
    return state
