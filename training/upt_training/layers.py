"""The blocks of the UPT: sincos embedding, attention, MLP, pre-norm transformer and perceiver blocks, drop path.

Pre-norm LayerNorm with eps 1e-6, exact GELU, biases everywhere, no LayerScale, truncated-normal weights (std 0.02).
All tensors are `[..., tokens, width]`; any leading batch dimensions.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from torch import nn
from torch.nn import functional

EPS = 1e-6
DENSE_KEYS = 1024  # on the CPU PyTorch's fused attention is no faster in bfloat16; so many scores a query fit its cache


def sincos_frequencies(width: int) -> np.ndarray:
    """`w_k = 10000^(-2k/m)`, `k < m/2`, with `m` the largest even number of channels a coordinate can have."""
    m = width // 3
    m -= m % 2
    return (10000.0 ** (-2.0 * np.arange(m // 2) / m)).astype(np.float32)


@lru_cache
def frequencies_on(width: int, device: torch.device) -> torch.Tensor:
    """`sincos_frequencies`, copied to a device once: a CUDA graph holds no such copy."""
    return torch.from_numpy(sincos_frequencies(width)).to(device)


def sincos(coordinates: torch.Tensor, width: int) -> torch.Tensor:
    """`[n, 3]` model coordinates -> `[n, width]`: per coordinate `[sin | cos]`, zeros appended."""
    frequency = frequencies_on(width, coordinates.device).to(coordinates.dtype)
    angle = coordinates[..., :, None] * frequency
    wave = torch.cat([angle.sin(), angle.cos()], dim=-1).flatten(-2)
    return functional.pad(wave, (0, width - wave.shape[-1]))


class DropPath(nn.Module):
    """Drops a residual branch per sample (stochastic depth); works at micro-batch 1 as well."""

    def __init__(self, probability: float):
        super().__init__()
        self.probability = probability

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        if not self.training or self.probability == 0.0:
            return x
        keep = 1.0 - self.probability
        shape = (x.shape[0],) + (1,) * (x.ndim - 1) if x.ndim > 2 else (1,) * x.ndim
        return x * (torch.rand(shape, device=x.device) < keep).to(x.dtype) / keep


class Mlp(nn.Module):
    def __init__(self, width: int, hidden: int):
        super().__init__()
        self.fc1 = nn.Linear(width, hidden)
        self.fc2 = nn.Linear(hidden, width)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.fc2(functional.gelu(self.fc1(x)))


def attend(q: torch.Tensor, k: torch.Tensor, v: torch.Tensor, heads: int) -> torch.Tensor:
    """Multi-head attention of projected queries, keys and values."""

    def split(x: torch.Tensor) -> torch.Tensor:
        return x.unflatten(-1, (heads, -1)).transpose(-2, -3)

    q, k, v = split(q), split(k), split(v)
    if k.dtype == torch.bfloat16 and k.device.type == "cpu" and k.shape[-2] <= DENSE_KEYS:
        q = q.to(k.dtype)
        with torch.autocast("cpu", enabled=False):
            out = ((q * q.shape[-1] ** -0.5) @ k.transpose(-1, -2)).softmax(-1) @ v
    else:
        out = functional.scaled_dot_product_attention(q, k, v)
    return out.transpose(-2, -3).flatten(-2)


class Block(nn.Module):
    """`x += attention(LN x)`, `x += MLP(LN x)`."""

    def __init__(self, width: int, heads: int, mlp_ratio: int, drop_path: float):
        super().__init__()
        self.heads = heads
        self.norm1 = nn.LayerNorm(width, eps=EPS)
        self.qkv = nn.Linear(width, 3 * width)
        self.proj = nn.Linear(width, width)
        self.norm2 = nn.LayerNorm(width, eps=EPS)
        self.mlp = Mlp(width, mlp_ratio * width)
        self.drop = DropPath(drop_path)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        q, k, v = self.qkv(self.norm1(x)).chunk(3, dim=-1)
        x = x + self.drop(self.proj(attend(q, k, v, self.heads)))
        return x + self.drop(self.mlp(self.norm2(x)))


class PerceiverPool(nn.Module):
    """Learned queries read the context once: cross-attention block to `tokens x width`."""

    def __init__(self, tokens: int, width: int, context: int, heads: int, mlp_ratio: int):
        super().__init__()
        self.heads = heads
        self.tokens = nn.Parameter(torch.zeros(tokens, width))
        self.norm_q = nn.LayerNorm(width, eps=EPS)
        self.norm_kv = nn.LayerNorm(context, eps=EPS)
        self.q = nn.Linear(width, width)
        self.kv = nn.Linear(context, 2 * width)
        self.proj = nn.Linear(width, width)
        self.norm2 = nn.LayerNorm(width, eps=EPS)
        self.mlp = Mlp(width, mlp_ratio * width)
        nn.init.trunc_normal_(self.tokens, std=0.02)

    def forward(self, context: torch.Tensor) -> torch.Tensor:
        x = self.tokens.expand(*context.shape[:-2], *self.tokens.shape)
        k, v = self.kv(self.norm_kv(context)).chunk(2, dim=-1)
        x = x + self.proj(attend(self.q(self.norm_q(x)), k, v, self.heads))
        return x + self.mlp(self.norm2(x))


class Decoder(nn.Module):
    """Perceiver decoder: query `x = MLP(sincos(p))`, one cross-attention, MLP, LayerNorm, Linear to 3."""

    def __init__(self, width: int, heads: int, mlp_ratio: int, latent: int):
        super().__init__()
        self.heads = heads
        self.query1 = nn.Linear(width, width)
        self.query2 = nn.Linear(width, width)
        self.norm1 = nn.LayerNorm(width, eps=EPS)
        self.q = nn.Linear(width, width)
        self.norm_kv = nn.LayerNorm(latent, eps=EPS)
        self.kv = nn.Linear(latent, 2 * width)
        self.proj = nn.Linear(width, width)
        self.norm2 = nn.LayerNorm(width, eps=EPS)
        self.mlp = Mlp(width, mlp_ratio * width)
        self.norm3 = nn.LayerNorm(width, eps=EPS)
        self.head = nn.Linear(width, 3)

    def queries(self, embedding: torch.Tensor) -> torch.Tensor:
        """`[n, h]` sincos embedding -> the query table `[n, 2h]` = `[x | q]`."""
        x = self.query2(functional.gelu(self.query1(embedding)))
        return torch.cat([x, self.q(self.norm1(x))], dim=-1)

    def keys_values(self, latent: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        k, v = self.kv(self.norm_kv(latent)).chunk(2, dim=-1)
        return k, v

    def forward(self, query: torch.Tensor, k: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
        """Query table `[n, 2h]`, keys and values `[..., L, h]` -> `[..., n, 3]` (unscaled)."""
        x, q = query.chunk(2, dim=-1)
        if k.ndim > 2 and q.ndim < k.ndim:
            q = q.expand(*k.shape[:-2], *q.shape)
        y = x + self.proj(attend(q, k, v, self.heads))
        y = y + self.mlp(self.norm2(y))
        with torch.autocast(y.device.type, enabled=False):  # bfloat16 would round what is left of the residual
            return self.head(self.norm3(y.float() if y.dtype == torch.bfloat16 else y))
