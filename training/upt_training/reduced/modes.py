"""Residual modes: proper orthogonal decomposition of `R = u - L(c)` over training frames.

The SVD is randomised (Halko, Martinsson and Tropp 2011): two products with the sampled frames per power iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from upt_training.reduced.transfer import Source


@dataclass
class Modes:
    """Orthonormal rows: residual modes `[r, 3K]` and response modes `[r_z, 3K]`; amplitudes are RMS over frames, mm."""

    residual: np.ndarray
    residual_amplitudes: np.ndarray
    response: np.ndarray
    response_amplitudes: np.ndarray


def leading_modes(frames: np.ndarray, count: int, seed: int = 3, iterations: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Leading right singular vectors `[count, 3K]` and singular values over `sqrt(n)` of `frames [n, 3K]`."""
    width = min(count + 16, *frames.shape)
    rng = np.random.default_rng(seed)
    sketch = frames @ rng.standard_normal((frames.shape[1], width)).astype(np.float32)
    for _ in range(iterations):
        sketch, _ = np.linalg.qr(sketch)
        back, _ = np.linalg.qr(frames.T @ sketch)
        sketch = frames @ back
    left, _ = np.linalg.qr(sketch)
    small = left.T @ frames
    _, values, vectors = np.linalg.svd(small, full_matrices=False)
    count = min(count, len(values))
    return np.ascontiguousarray(vectors[:count]), values[:count] / np.sqrt(len(frames))


def learn_modes(
    sources: list[Source],
    residual_count: int,
    response_count: int,
    memory_gib: float = 1.0,
    seed: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Modes:
    """Modes of frames drawn at random from every case; two sets of sampled frames stay within `memory_gib` each."""
    rng = np.random.default_rng(seed)
    pairs = [(source, case) for source in sources for case in source.cases]
    width = sources[0].width
    share = int(memory_gib * 2**30 / (4 * width * max(len(pairs), 1)))
    share = max(1, min(share, 48))
    shares = [min(share, case.frames - 1) for _, case in pairs]
    ends = np.cumsum(shares)
    residual = np.zeros((ends[-1], width), np.float32)
    response = np.zeros((ends[-1], width), np.float32)
    for index, (source, case) in enumerate(pairs):
        picked = np.sort(rng.choice(np.arange(1, case.frames), shares[index], replace=False))
        linear, field = source.fields(case, picked)
        rows = slice(ends[index] - shares[index], ends[index])
        response[rows] = linear
        residual[rows] = field - linear
        progress(index + 1, len(pairs))
    phi, phi_amplitude = leading_modes(residual, residual_count)
    del residual
    psi, psi_amplitude = leading_modes(response, response_count)
    return Modes(phi, phi_amplitude, psi, psi_amplitude)
