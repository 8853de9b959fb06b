"""Lion (Chen et al. 2023), AdamW, and the learning-rate schedule: warm-up (constant or linear), cosine."""

from __future__ import annotations

import math

import torch


class Lion(torch.optim.Optimizer):
    """Sign of an interpolated momentum; decoupled weight decay."""

    def __init__(self, parameters, lr: float, betas=(0.9, 0.99), weight_decay: float = 0.0):
        super().__init__(parameters, {"lr": lr, "betas": betas, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure=None):
        for group in self.param_groups:
            first, second = group["betas"]
            own = [p for p in group["params"] if p.grad is not None]
            for p in own:
                if not self.state[p]:
                    self.state[p]["momentum"] = torch.zeros_like(p)
            gradients, momenta = [p.grad for p in own], [self.state[p]["momentum"] for p in own]
            torch._foreach_mul_(own, 1.0 - group["lr"] * group["weight_decay"])
            signs = torch._foreach_lerp(momenta, gradients, 1.0 - first)
            torch._foreach_sign_(signs)
            torch._foreach_add_(own, signs, alpha=-group["lr"])
            torch._foreach_lerp_(momenta, gradients, 1.0 - second)


def make_optimiser(settings, model: torch.nn.Module) -> torch.optim.Optimizer:
    if settings.optimiser == "lion":
        return Lion(model.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)
    return torch.optim.AdamW(
        model.parameters(),
        settings.learning_rate,
        betas=(0.9, 0.98),
        weight_decay=settings.weight_decay,
        fused=True,
    )


def learning_rate(settings, epoch: float) -> float:
    """At a (fractional) epoch. Lion: constant warm-up phase, then cosine. AdamW: linear warm-up, then cosine."""
    total = settings.epochs + settings.autoregressive_epochs
    if epoch < settings.warmup_epochs:
        ramp = 1.0 if settings.optimiser == "lion" else (epoch + 1e-3) / settings.warmup_epochs
        return settings.learning_rate * ramp
    progress = (epoch - settings.warmup_epochs) / max(1e-9, total - settings.warmup_epochs)
    return settings.learning_rate * (0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * min(1.0, progress))))
