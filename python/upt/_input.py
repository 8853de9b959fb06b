"""The input of a step or a frame as it lies in memory for the C ABI.

This runs in every step. The struct and its instruments lie in one piece of memory that each call makes anew: another
thread that is in a call on the same scene has its own.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from ctypes import addressof, c_char
from struct import Struct

from numpy.typing import ArrayLike

from upt import _native
from upt._arrays import Contacts, address, number, vectors
from upt.instrument import Instrument, records
from upt.loads import OFFSET, Loads

#: `upt_input` as it lies in memory, but for its loads.
_LAYOUT = Struct("@I4xPQPPQPPd")
_SIZE = ctypes.sizeof(_native.Input)
assert _LAYOUT.size == OFFSET
_BLANK = bytes(_SIZE)

#: Where the input lies, how many instruments it has, and what must live over the call.
Place = tuple[int, int, object]


class Inputs:
    """The inputs of a scene of `node_count` nodes; where lists of contacts lie is kept from call to call."""

    __slots__ = ("_contacts", "_node_count")

    def __init__(self, node_count: int) -> None:
        self._contacts = Contacts()
        self._node_count = node_count

    def place(
        self,
        instruments: Sequence[Instrument],
        contacts: tuple[ArrayLike, ArrayLike] | None,
        collision: ArrayLike | None,
        displacement: ArrayLike | None,
        time_s: float,
        loads: Loads | None = None,
    ) -> Place:
        """An input of these fields; `Scene.step` says what they are."""
        packed, count = records(instruments)
        memory = bytearray(_BLANK if packed is None else b"".join((_BLANK, packed)))
        at = addressof(c_char.from_buffer(memory))
        tools = at + _SIZE if count else 0
        time_s = number(time_s, "time_s")
        acting = None if loads is None else loads.pack_into(memory, self._node_count)
        if contacts is None and collision is None and displacement is None:
            _LAYOUT.pack_into(memory, 0, _SIZE, tools, count, 0, 0, 0, 0, 0, time_s)
            return at, count, (memory, acting)
        nodes = imposed = listed = 0
        lists = None
        if contacts is not None:
            lists = self._contacts.place(*_pair(contacts))
            nodes, imposed, listed = lists[2:5]
        field = None if collision is None else vectors(collision, "collision", self._node_count)
        start = None if displacement is None else vectors(displacement, "displacement", self._node_count)
        _LAYOUT.pack_into(
            memory, 0, _SIZE, tools, count, nodes, imposed, listed,
            0 if field is None else address(field), 0 if start is None else address(start), time_s,
        )  # fmt: skip
        return at, count, (memory, acting, lists, field, start)


def _pair(contacts: tuple[ArrayLike, ArrayLike]) -> tuple[ArrayLike, ArrayLike]:
    try:
        nodes, imposed = contacts
    except (TypeError, ValueError):
        raise TypeError("contacts is no pair of nodes and vectors") from None
    return nodes, imposed
