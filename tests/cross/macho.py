"""What a Mach-O library for macOS says of itself, read here, where nothing can load it.

python tests/cross/macho.py LIBRARY HEADER: it exports the functions of the header and nothing else, is found by its
install name, is signed as macOS asks of arm64 (ad hoc), and needs nothing but the system's own libraries. Ends with 1
and a line for each fault.
"""

from __future__ import annotations

import re
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

MAGIC = 0xFEEDFACF
CPUS = {0x0100000C: "arm64", 0x01000007: "x86_64"}
SYMTAB, LOAD_DYLIB, ID_DYLIB, SIGNATURE, VERSION_MIN, BUILD_VERSION = 0x2, 0xC, 0xD, 0x1D, 0x24, 0x32
EXTERNAL, DEFINED_IN_SECTION, TYPE, DEBUG, PRIVATE = 0x01, 0x0E, 0x0E, 0xE0, 0x10
INSTALL_NAME = "@rpath/libupt.0.dylib"
OF_THE_SYSTEM = ("/usr/lib/", "/System/Library/")


def commands(file: bytes) -> Iterator[tuple[int, bytes]]:
    """Load commands: number and bytes."""
    count = struct.unpack_from("<I", file, 16)[0]
    at = 32
    for _ in range(count):
        number, size = struct.unpack_from("<II", file, at)
        yield number & 0x7FFFFFFF, file[at : at + size]
        at += size


def text(command: bytes) -> str:
    """The string of a command about a library."""
    return command[struct.unpack_from("<I", command, 8)[0] :].split(b"\0")[0].decode()


def exported(file: bytes, command: bytes) -> set[str]:
    """Symbols that others may link against."""
    symbols, count, strings = struct.unpack_from("<III", command, 8)
    found = set()
    for index in range(count):
        name, kind = struct.unpack_from("<IB", file, symbols + 16 * index)
        if kind & EXTERNAL and not kind & (DEBUG | PRIVATE) and kind & TYPE == DEFINED_IN_SECTION:
            start = strings + name
            found.add(file[start : file.index(b"\0", start)].decode().removeprefix("_"))
    return found


def main() -> int:
    """Checks one library."""
    path, header = (Path(name) for name in sys.argv[1:3])
    file = path.read_bytes()
    magic, cpu = struct.unpack_from("<II", file, 0)
    if magic != MAGIC:
        print(f"{path} is no Mach-O file of 64 bits")
        return 1
    found = list(commands(file))
    by_number = dict(found)
    faults = []
    names = exported(file, by_number[SYMTAB])
    wanted = set(re.findall(r"\b(upt_\w+)\(", header.read_text(encoding="utf-8")))
    faults += [f"{name} is not exported" for name in sorted(wanted - names)]
    faults += [f"{name} is exported, and not in the header" for name in sorted(names - wanted)]
    if text(by_number[ID_DYLIB]) != INSTALL_NAME:
        faults.append(f"its install name is {text(by_number[ID_DYLIB])}, not {INSTALL_NAME}")
    if CPUS.get(cpu) == "arm64" and SIGNATURE not in by_number:
        faults.append("it is not signed: macOS loads nothing unsigned on arm64")
    needs = [text(command) for number, command in found if number == LOAD_DYLIB]
    faults += [f"it needs {name}" for name in needs if not name.startswith(OF_THE_SYSTEM)]
    at, told = (12, by_number[BUILD_VERSION]) if BUILD_VERSION in by_number else (8, by_number[VERSION_MIN])
    oldest = struct.unpack_from("<I", told, at)[0]
    since = f"macOS {oldest >> 16}.{oldest >> 8 & 255} or later"
    what = f"{CPUS.get(cpu, cpu)}, {since}, {len(names)} functions, needs {', '.join(needs)}"
    print("\n".join(faults) or what)
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
