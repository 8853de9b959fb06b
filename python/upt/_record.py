"""Structs of the C ABI as Python objects: keywords set fields, attributes read them as enums, bools and tuples.

`_native.py` lists the fields; nothing here knows a field by name but `struct_size`.
"""

from __future__ import annotations

import ctypes
import operator
import os
from enum import IntEnum, IntFlag
from reprlib import repr as short
from typing import Any


class Record(ctypes.Structure):
    """A struct; where it begins with its own size, that is set."""

    def __init__(self, **values: Any) -> None:
        names = self.field_names()
        for name in values:
            if name not in names:
                raise TypeError(f"{type(self).__name__} has no field {name!r}; it has {', '.join(names)}")
        super().__init__(**values)
        if self._fields_[0][0] == "struct_size":
            self.struct_size = ctypes.sizeof(self)

    def __setattr__(self, name: str, value: Any) -> None:
        """As usual; a value of the wrong type is an error that names the field."""
        try:
            super().__setattr__(name, value)
        except TypeError as error:
            field = name.removeprefix("_")
            if str(error).startswith(f"{field} "):
                raise
            raise TypeError(f"{field} is {short(value)}: {error}") from None

    @classmethod
    def field_names(cls) -> list[str]:
        """The fields that mean something to a caller."""
        names = [field[0].removeprefix("_") for field in cls._fields_]
        return [name for name in names if name not in ("struct_size", "reserved")]

    def as_dict(self) -> dict[str, Any]:
        """All fields by name."""
        return {name: getattr(self, name) for name in self.field_names()}

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={value!r}" for name, value in self.as_dict().items())
        return f"{type(self).__name__}({fields})"


def _as_enum(kind: type[Any], value: Any, field: str) -> int:
    if isinstance(value, str):
        try:
            return int(kind[value.upper()])
        except KeyError:
            known = ", ".join(member.name.lower() for member in kind)
            raise ValueError(f"{field}: {value!r} is not one of {known}") from None
    return operator.index(value)


def choice(raw: str, kind: type[IntEnum] | type[IntFlag]) -> Any:
    """A number that an enum names; set by the member, its name in any case, or the number."""
    field = raw.removeprefix("_")

    def read(record: Any) -> int:
        value: int = getattr(record, raw)
        try:
            return kind(value)
        except ValueError:  # a member that this package is too old to know
            return value

    def write(record: Any, value: Any) -> None:
        setattr(record, raw, _as_enum(kind, value, field))

    return property(read, write)


def switch(raw: str) -> Any:
    """On, off, or as usual: `True`, `False`, `None`."""
    meanings = {0: None, 1: True, 2: False}

    def read(record: Any) -> bool | None:
        return meanings.get(getattr(record, raw))

    def write(record: Any, value: Any) -> None:
        setattr(record, raw, 0 if value is None else 1 if value else 2)

    return property(read, write)


def corrections(raw: str, kind: type[Any]) -> Any:
    """How many corrections a step gets: a record of `kind`, the name of a mode, or a count (0: as recommended)."""
    field = raw.removeprefix("_")

    def read(record: Any) -> Any:
        return getattr(record, raw)

    def write(record: Any, value: Any) -> None:
        if isinstance(value, str):
            value = kind(mode=value)
        elif not isinstance(value, kind):
            count = operator.index(value)
            if not 0 <= count <= 64:
                raise ValueError(f"{field} is {count}; give 1 to 64, 0 for as many as the bundle recommends, or 'none'")
            value = kind(mode="count", count=count) if count else kind()
        setattr(record, raw, value)

    return property(read, write)


def boolean(raw: str) -> Any:
    """A byte that is 0 or 1."""

    def read(record: Any) -> bool:
        return bool(getattr(record, raw))

    def write(record: Any, value: Any) -> None:
        setattr(record, raw, bool(value))

    return property(read, write)


def text(raw: str) -> Any:
    """A UTF-8 string or a path."""

    def read(record: Any) -> str | None:
        value: bytes | None = getattr(record, raw)
        return None if value is None else value.decode()

    def write(record: Any, value: str | os.PathLike[str] | None) -> None:
        setattr(record, raw, None if value is None else os.fsencode(value))

    return property(read, write)


def vector(raw: str) -> Any:
    """A fixed array of numbers, seen as a tuple."""
    field = raw.removeprefix("_")

    def read(record: Any) -> tuple[Any, ...]:
        return tuple(getattr(record, raw))

    def write(record: Any, value: Any) -> None:
        present = getattr(record, raw)
        numbers = tuple(present._type_(number).value for number in value)
        if len(numbers) != len(present):
            raise ValueError(f"{field} has {len(present)} numbers, not {len(numbers)}")
        setattr(record, raw, numbers)

    return property(read, write)


def numbers(raw: str, count: str, element: type[Any], kind: type[Any]) -> Any:
    """A pointer to numbers whose count another field holds; the record keeps the array alive."""
    field = raw.removeprefix("_")

    def read(record: Any) -> tuple[Any, ...]:
        address, length = getattr(record, raw), getattr(record, count)
        return tuple(kind(number) for number in (element * length).from_address(address)) if address else ()

    def write(record: Any, value: Any) -> None:
        array = [_as_enum(kind, number, field) if issubclass(kind, IntEnum) else number for number in value]
        kept = (element * len(array))(*array)
        record.__dict__[raw + "_kept"] = kept
        setattr(record, raw, ctypes.addressof(kept) if array else None)
        setattr(record, count, len(array))

    return property(read, write)
