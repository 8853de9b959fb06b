"""What a failed call raises. The message is the library's: it names the argument, the file or the field."""

from __future__ import annotations

from upt._native import Status


class Error(Exception):
    """A call of libupt failed. Nothing has changed: a scene keeps its last good state."""

    #: `upt.Status`, or a number that this package does not know.
    status: Status | int

    def __init__(self, message: str, status: Status | int) -> None:
        super().__init__(message)
        self.status = status


class ArgumentError(Error, ValueError):
    """A size, an index, an enum or a range is wrong, or an input holds NaN or Inf."""


class StateError(Error):
    """The call does not fit the state: closed, nothing submitted, no points attached."""


class BusyError(StateError):
    """Another thread is in a call on this scene, or a step is in flight."""


class UnsupportedError(Error):
    """This build or this bundle cannot do it."""


class OutOfMemoryError(Error, MemoryError):
    """There is not enough memory for the call."""


class RuntimeLibraryError(Error):
    """ONNX Runtime is missing, too old or broken, or no provider of the list can run the model."""


class BundleError(Error):
    """A bundle, mesh or snapshot cannot be read, is invalid, or has a version that is not supported."""


class GuardError(Error):
    """The guard refused the new state; the last good state stays."""


class PanicError(Error):
    """A bug in the library; the scene can only be closed."""


_CLASSES: dict[int, type[Error]] = {
    Status.NULL: ArgumentError,
    Status.ARGUMENT: ArgumentError,
    Status.NON_FINITE: ArgumentError,
    Status.HANDLE: StateError,
    Status.STATE: StateError,
    Status.BUSY: BusyError,
    Status.UNSUPPORTED: UnsupportedError,
    Status.OUT_OF_MEMORY: OutOfMemoryError,
    Status.RUNTIME: RuntimeLibraryError,
    Status.PROVIDER: RuntimeLibraryError,
    Status.IO: BundleError,
    Status.BUNDLE: BundleError,
    Status.VERSION: BundleError,
    Status.SNAPSHOT: BundleError,
    Status.GUARD: GuardError,
    Status.PANIC: PanicError,
}


def error_of(status: int, message: str) -> Error:
    """The exception of a negative status."""
    known = status in Status._value2member_map_
    name = Status(status).name if known else f"status {status}"
    return _CLASSES.get(status, Error)(f"{message or 'the library gave no message'} ({name})", status)
