"""Tables of a prior in whole steps: each number is a code times a step, and a group of codes has 0, 4, 8 or 16 bits.

A field is a sum of many terms, so a number need not be finer than the error that the others make anyway: float16 gives
small numbers digits that no sum shows. Groups are eight coordinates of a contact node's three rows of `response`, and
eight columns of a block of `basis` (docs/reference/formats.md).
"""

from __future__ import annotations

import numpy as np

from upt_training.errors import InputError

BITS = np.array([0, 4, 8, 16])
LIMITS = (0, 7, 127, 32767)  # largest code of each width


def packed(groups: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Bytes of whole-numbered groups, one after another, and the width (0 to 3) of each."""
    widths, parts = np.zeros(len(groups), np.uint8), []
    for at, codes in enumerate(groups):
        flat = codes.ravel()
        width = int(np.searchsorted(LIMITS, np.abs(flat).max(initial=0)))
        if width > 3:
            raise InputError(f"group {at} has a code of {np.abs(flat).max()}, more than 16 bits: give larger steps")
        widths[at] = width
        if width == 1:
            nibbles = (flat & 15).astype(np.uint8)
            parts.append((nibbles[0::2] | nibbles[1::2] << 4).tobytes())
        elif width:
            parts.append(flat.astype("<i1" if width == 2 else "<i2").tobytes())
    return np.frombuffer(b"".join(parts), np.uint8), widths


def unpacked(data: np.ndarray, widths: np.ndarray, counts: np.ndarray) -> list[np.ndarray]:
    """The codes of each group, of `counts` numbers."""
    out, at = [], 0
    for width, count in zip(widths, counts, strict=True):
        size = int(count) * int(BITS[width]) // 8
        own, at = data[at : at + size], at + size
        if width == 0:
            out.append(np.zeros(count, np.int16))
        elif width == 1:
            nibbles = np.stack([own & 15, own >> 4], 1).ravel().astype(np.int16)
            out.append((nibbles ^ 8) - 8)
        else:
            out.append(own.view("<i1" if width == 2 else "<i2").astype(np.int16))
    return out


def quarters(widths: np.ndarray) -> np.ndarray:
    """Widths `[..., n]` as two bits each, four to a byte, the first lowest."""
    padded = np.zeros((*widths.shape[:-1], -(-widths.shape[-1] // 4) * 4), np.uint8)
    padded[..., : widths.shape[-1]] = widths
    four = padded.reshape(*widths.shape[:-1], -1, 4)
    return (four << np.array([0, 2, 4, 6], np.uint8)).sum(-1, dtype=np.uint8)


def widths_of(bytes_: np.ndarray, count: int) -> np.ndarray:
    """The widths `[..., count]` behind `quarters`."""
    two = np.asarray(bytes_)[..., None] >> np.array([0, 2, 4, 6], np.uint8) & 3
    return two.reshape(*two.shape[:-2], -1)[..., :count]


def response_tensors(response: np.ndarray, step: float) -> dict[str, np.ndarray]:
    """`response [3D, Q]` in steps, mm/mN."""
    columns, width = len(response) // 3, response.shape[1]
    codes = np.rint(np.asarray(response, np.float64) / step).astype(np.int64)
    groups = codes.reshape(columns, 3, width // 8, 8).transpose(0, 2, 1, 3)
    data, widths = packed(list(groups.reshape(-1, 3, 8)))
    return {
        "response": data,
        "response_widths": quarters(widths.reshape(columns, -1)),
        "response_step": np.full(columns, step, np.float32),
    }


def basis_tensors(bases: list[np.ndarray], amplitudes: np.ndarray, error_mm: float) -> dict[str, np.ndarray]:
    """The basis in steps that are an error of `error_mm` where a coordinate `[Q]` has its amplitude."""
    groups, steps, at = [], [], 0
    for own in bases:
        for column in range(0, own.shape[1], 8):
            largest = max(float(amplitudes[at : at + 8].max()), 1e-9)
            part = np.asarray(own[:, column : column + 8], np.float64)
            # No finer than 16 bits have it, which float16 has not either.
            step = np.float32(max(min(error_mm / largest, 1.0), np.abs(part).max() / 32766))
            groups.append(np.rint(part / step).astype(np.int64))
            steps.append(step)
            at += 8
    data, widths = packed(groups)
    return {"basis": data, "basis_widths": quarters(widths), "basis_step": np.array(steps, np.float32)}


def in_numbers(tensors: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The tensors of a prior with basis and response as float16, however they are stored."""
    out = dict(tensors)
    rank_offsets = np.asarray(tensors["rank_offsets"])
    count = int(rank_offsets[-1]) // 8
    if "response_step" in tensors:
        steps = np.asarray(tensors["response_step"], np.float32)
        widths = widths_of(tensors["response_widths"], count).ravel()
        codes = unpacked(np.asarray(tensors["response"]), widths, np.full(len(widths), 24))
        numbers = np.array(codes, np.float32).reshape(len(steps), count, 3, 8) * steps[:, None, None, None]
        out["response"] = numbers.transpose(0, 2, 1, 3).reshape(3 * len(steps), 8 * count).astype(np.float16)
    if "basis_step" in tensors:
        rows = 3 * np.diff(np.asarray(tensors["block_offsets"]))
        counts = np.repeat(rows, np.diff(rank_offsets) // 8)
        widths = widths_of(tensors["basis_widths"], count)
        codes = unpacked(np.asarray(tensors["basis"]), widths, 8 * counts)
        steps = np.asarray(tensors["basis_step"], np.float32)
        parts = [one.reshape(-1, 8).astype(np.float32) * step for one, step in zip(codes, steps, strict=True)]
        ends = rank_offsets // 8
        blocks = [np.concatenate(parts[a:b], axis=1).ravel() for a, b in zip(ends[:-1], ends[1:], strict=True) if b > a]
        out["basis"] = np.concatenate(blocks).astype(np.float16)
    return out
