"""NumPy arrays at the C boundary: an address where an array fits as it is, a copy where an input does not.

This runs in every step, with caches that the step has emptied: what fits is recognised in few operations.
"""

from __future__ import annotations

from ctypes import addressof, c_char, c_uint64, c_void_p
from reprlib import repr as short
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]
Indices = NDArray[np.uint32]

_F32, _U32 = np.dtype(np.float32), np.dtype(np.uint32)

Place = tuple[Floats, c_void_p, c_uint64, int]
#: The two arrays of a caller, where what stands for them lies, its length, and what must live over the call.
Lists = tuple[object, object, int, int, int, object]


class Outputs:
    """Where calls write their results: an array's address is kept for as long as the same array comes again.

    Two threads may share one: what it keeps is replaced as a whole.
    """

    __slots__ = ("_last",)

    def __init__(self) -> None:
        self._last: Place = (np.empty(0, np.float32), c_void_p(), c_uint64(), -1)

    def place(self, out: Floats | None, count: int) -> Place:
        """The array for `count` rows, as `output` makes or checks it, where it lies, its length in floats, `count`."""
        last = self._last
        if out is last[0] and count == last[3] and last[0].flags.carray:
            return last
        result = output(out, count)
        found = (result, c_void_p(address(result)), c_uint64(result.size), count)
        if out is not None:
            self._last = found
        return found


def address(array: NDArray[Any]) -> int:
    """Where the data lie; the caller keeps the array alive over the call."""
    try:
        # A third of the time of the attribute below.
        return addressof(c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # read-only, or empty
        data: int = array.__array_interface__["data"][0]
        return data


def number(value: float, name: str) -> float:
    """A number that an argument is; an error that names it where it is none."""
    if type(value) is float:
        return value
    try:
        # A word is none, whatever it spells.
        return float(value + 0)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {short(value)}, expected a number") from None


def floats(values: ArrayLike, name: str) -> Floats:
    """An array of float32 in one piece."""
    try:
        return np.ascontiguousarray(values, np.float32)
    except (TypeError, ValueError) as error:
        raise _named(values, name, "numbers", error) from None


def _named(values: ArrayLike, name: str, wanted: str, error: Exception) -> Exception:
    """An error of NumPy's with the argument's name: uneven rows are wrong values, all else wrong types."""
    if "inhomogeneous" in str(error):
        return ValueError(f"{name}: {error}")
    return TypeError(f"{name} is {short(values)}, expected {wanted}: {error}")


def vectors(values: ArrayLike, name: str, count: int | None = None) -> Floats:
    """`[count, 3]` float32 in one piece; the array itself where it is that already."""
    fits = type(values) is ndarray and values.dtype is _F32 and values.flags.c_contiguous
    array: Floats = values if fits else floats(values, name)  # type: ignore[assignment]
    if array.ndim != 2 or array.shape[1] != 3 or (count is not None and len(array) != count):
        wanted = f"({'n' if count is None else count}, 3)"
        raise ValueError(f"{name} has shape {array.shape}, expected {wanted}")
    return array


def indices(values: ArrayLike, name: str) -> Indices:
    """`[n]` uint32 in one piece; the array itself where it is that already."""
    if type(values) is ndarray and values.dtype is _U32 and values.ndim == 1 and values.flags.c_contiguous:
        return values
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise _named(values, name, "node indices", error) from None
    if array.dtype.kind not in "iuf" or (array.size and array.dtype.kind == "f"):
        raise TypeError(f"{name} has dtype {array.dtype}, expected node indices")
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}, expected (n,)")
    if array.dtype != np.uint32:
        if array.size and (array.min() < 0 or array.max() > 0xFFFFFFFF):
            raise ValueError(f"{name}: an index is negative or passes 32 bits")
    return np.ascontiguousarray(array, np.uint32)


class Contacts:
    """The lists of contacts that calls get: where they lie is remembered for when the same two arrays come again.

    Two threads may share one, as `Outputs`.
    """

    __slots__ = ("_last",)

    def __init__(self) -> None:
        self._last: Lists = (self, self, 0, 0, 0, None)

    def place(self, nodes: ArrayLike, contact: ArrayLike) -> Lists:
        """Where nodes `[n]` and vectors `[n, 3]` lie, and n; to be kept over the call."""
        last = self._last
        if nodes is last[0] and contact is last[1]:
            return last
        n = indices(nodes, "nodes")
        if not n.size and not np.size(contact):
            return nodes, contact, 0, 0, 0, None
        c = vectors(contact, "contact", len(n))
        found: Lists = (nodes, contact, address(n), address(c), len(n), (n, c))
        if n is nodes and c is contact:
            self._last = found
        return found


def output(out: Floats | None, count: int, name: str = "out") -> Floats:
    """Where a result goes: a new array, or the caller's own, which must fit without a copy."""
    if out is None:
        return np.empty((count, 3), np.float32)
    if not isinstance(out, ndarray):
        raise TypeError(
            f"{name} must be a writeable C-contiguous float32 array of shape ({count}, 3), not {short(out)}"
        )
    if out.dtype != _F32 or out.shape != (count, 3) or not out.flags.carray:
        raise ValueError(f"{name} must be a writeable C-contiguous float32 array of shape ({count}, 3)")
    return out
