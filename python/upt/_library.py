"""Finds, opens and starts libupt, and turns its statuses into exceptions."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import sys
import threading
from pathlib import Path
from typing import Any

from upt._native import ABI_VERSION, FUNCTIONS, InitOptions, Status
from upt.errors import error_of

#: File name of the library by `sys.platform`.
NAMES = {"win32": "upt.dll", "darwin": "libupt.dylib"}


def _open() -> ctypes.CDLL:
    path = os.environ.get("UPT_LIBRARY")
    if path is None:
        path = str(Path(__file__).parent / "lib" / NAMES.get(sys.platform, "libupt.so"))
        if not Path(path).exists():
            raise ImportError(
                f"{path} does not exist: install the package by `pip install ./python` (it builds libupt with cargo), "
                "or set UPT_LIBRARY to a libupt that you built"
            )
    library = ctypes.CDLL(path)  # CDLL releases the GIL around each call
    for name, (result, parameters) in FUNCTIONS.items():
        try:
            function = getattr(library, name)
        except AttributeError:
            raise ImportError(f"{path} has no function {name}: it is older than this package") from None
        function.restype, function.argtypes = result, parameters
    version = library.upt_abi_version()
    if version != ABI_VERSION:
        raise ImportError(f"{path} speaks ABI version {version}, this package {ABI_VERSION}")
    return library


lib: Any = _open()
_start = threading.Lock()
_started = False


def check(status: int) -> int:
    """Raises what a negative status stands for."""
    if status < 0:
        message = lib.upt_last_error().decode()
        if status == Status.RUNTIME and packaged_onnxruntime() is None:
            message += '; Python has one by `pip install "libupt[learned]"`'
        raise error_of(status, message)
    return status


def init(*, threads: int = 0, onnxruntime_path: str | os.PathLike[str] | None = None) -> None:
    """Starts the library; optional, the first model does it.

    Args:
        threads: threads of a model that states none (0: one).
        onnxruntime_path: ONNX Runtime's shared library; None: `ORT_DYLIB_PATH`, else that of the package `onnxruntime`.

    Raises:
        upt.StateError: the library runs already with other options.
    """
    global _started
    path = onnxruntime_path or os.environ.get("ORT_DYLIB_PATH") or packaged_onnxruntime()
    with _start:
        check(lib.upt_init(ctypes.byref(InitOptions(threads=threads, onnxruntime_path=path))))
        _started = True


def ensure_started() -> None:
    """`init` with the defaults, once."""
    if not _started:
        init()


def packaged_onnxruntime() -> Path | None:
    """The shared library in the package `onnxruntime`, without importing it; None where it is not installed."""
    spec = importlib.util.find_spec("onnxruntime")
    folders = spec.submodule_search_locations if spec else None
    patterns = {"win32": "onnxruntime.dll", "darwin": "libonnxruntime.*dylib"}
    pattern = patterns.get(sys.platform, "libonnxruntime.so*")
    for folder in folders or []:
        found = sorted((Path(folder) / "capi").glob(pattern))
        if found:
            return found[0]
    return None


def read_text(function: Any, *arguments: Any) -> str:
    """A string of a call that takes `out, capacity, needed`."""
    needed = ctypes.c_uint64()
    check(function(*arguments, None, 0, ctypes.byref(needed)))
    buffer = ctypes.create_string_buffer(needed.value)
    check(function(*arguments, buffer, needed.value, None))
    return buffer.value.decode()
