"""Memory that a training step frees stays with the process.

glibc maps each large block anew and gives it back when it is freed, so a step, which frees and takes the same blocks
again and again, spends much of its time in page faults.
"""

from __future__ import annotations

import ctypes
import sys

# mallopt(3).
TRIM_THRESHOLD, TOP_PAD, MMAP_MAX = -1, -2, -4
KEPT = 2**31 - 1  # bytes that may lie free at the heap's end
PAD = 2**28  # bytes by which the heap grows


def keep_freed_memory() -> bool:
    """For the rest of the process; False where the C library is not glibc."""
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return all([mallopt(MMAP_MAX, 0), mallopt(TRIM_THRESHOLD, KEPT), mallopt(TOP_PAD, PAD)])
