"""The library's messages in Python's `logging`, under the name `upt`."""

from __future__ import annotations

import ctypes
import logging

from upt._library import check, lib
from upt._native import LogLevel

_LEVELS = {
    LogLevel.ERROR: logging.ERROR,
    LogLevel.WARN: logging.WARNING,
    LogLevel.INFO: logging.INFO,
    LogLevel.DEBUG: logging.DEBUG,
    LogLevel.TRACE: logging.DEBUG,
}
_logger = logging.getLogger("upt")


def _receive(level: int, message: bytes, _user: int | None) -> None:
    _logger.log(_LEVELS.get(LogLevel(level), logging.DEBUG), "%s", message.decode(errors="replace"))


#: Kept as long as the module: the library calls it.
_RECEIVER = ctypes.CFUNCTYPE(None, ctypes.c_int32, ctypes.c_char_p, ctypes.c_void_p)(_receive)


def set_log(level: LogLevel | str) -> None:
    """Sends messages of this severity and above to the logger `upt`; `"off"` turns this off."""
    chosen = LogLevel[level.upper()] if isinstance(level, str) else LogLevel(level)
    callback = None if chosen is LogLevel.OFF else ctypes.cast(_RECEIVER, ctypes.c_void_p)
    check(lib.upt_set_log(callback, None, chosen))
