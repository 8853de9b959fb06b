"""What a library for Android says of itself, read here, where nothing can load it.

python tests/cross/android.py LIBRARY HEADER: an ELF file for arm64 that exports the functions of the header and nothing
else, and takes nothing from others but what the crate `libc` declares of Android's C library, its mathematics, and the
unwinder that the NDK links in. Ends with 1 and a line for each fault.
"""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
from pathlib import Path

ARM64 = 183
SECTION, DYNSYM = struct.Struct("<IIQQQQIIQQ"), 11
SYMBOL = struct.Struct("<IBBHQQ")
#: Of the C library too, though Rust declares them elsewhere.
MATHS = set(
    """
    acos acosf asin asinf atan atan2 atan2f atanf cbrt ceil cos cosh exp exp2 exp2f expf expm1 floor fma fmaf
    fmod fmodf hypot hypotf ldexp log log10 log1p log2 logf pow powf rint round
    sin sincos sincosf sinf cosf sinh sqrt tan tanh tgamma trunc
    """.split()
)
COMPILERS = set("memcpy memmove memset memcmp bcmp strlen __errno __cxa_finalize __register_atfork".split())


def symbols(file: bytes) -> tuple[set[str], set[str]]:
    """Dynamic symbols: what is exported, and what is taken from others."""
    at, size, count = (
        struct.unpack_from("<Q", file, 40)[0],
        *struct.unpack_from("<HH", file, 58),
    )
    sections = [SECTION.unpack_from(file, at + size * index) for index in range(count)]
    exported, taken = set(), set()
    for _, kind, _, _, begin, length, link, *_ in sections:
        if kind != DYNSYM:
            continue
        names = sections[link][4]
        for place in range(begin + SYMBOL.size, begin + length, SYMBOL.size):
            name, _, _, section, *_ = SYMBOL.unpack_from(file, place)
            start = names + name
            (exported if section else taken).add(file[start : file.index(b"\0", start)].decode())
    return exported, taken


def declared() -> str:
    """What the crate `libc` says of Unix and Android: its source, as cargo has it here."""
    told = subprocess.run(["cargo", "metadata", "--format-version", "1"], capture_output=True, check=True).stdout
    [crate] = [one for one in json.loads(told)["packages"] if one["name"] == "libc"]
    root = Path(crate["manifest_path"]).parent / "src"
    files = [path for path in root.rglob("*.rs") if {"unix", "new"} & set(path.parts)]
    return "\n".join(path.read_text(encoding="utf-8") for path in files)


def main() -> int:
    """Checks one library."""
    path, header = (Path(name) for name in sys.argv[1:3])
    file = path.read_bytes()
    if file[:5] != b"\x7fELF\x02" or struct.unpack_from("<H", file, 18)[0] != ARM64:
        print(f"{path} is no ELF file for arm64")
        return 1
    exported, taken = symbols(file)
    wanted = set(re.findall(r"\b(upt_\w+)\(", header.read_text(encoding="utf-8")))
    faults = [f"{name} is not exported" for name in sorted(wanted - exported)]
    faults += [f"{name} is exported, and not in the header" for name in sorted(exported - wanted)]
    unwinder = {name for name in taken if name.startswith("_Unwind_")}
    known = set(re.findall(r"\bfn (\w+)\(", declared())) | MATHS | COMPILERS
    faults += [f"{name} is not known of Android" for name in sorted(taken - unwinder - known)]
    what = (
        f"arm64, {len(exported)} functions; open: {len(taken - unwinder)} of Android's C library, "
        f"{len(unwinder)} of the NDK's unwinder"
    )
    print("\n".join(faults) or what)
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
