"""The one error type for wrong input: its message names file, field and index; the command line exits with 2."""


class InputError(Exception):
    """Input (a file, a configuration, a device) cannot be used; the message says what to do."""
