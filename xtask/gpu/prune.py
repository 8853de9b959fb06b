"""Leaves the device code of one architecture in a library of ONNX Runtime: `prune.py LIBRARY OUT ARCH`.

The sections `.nv_fatbin` hold entries of device code, each with its architecture (75, 80, ... 120). What belongs to
another one, PTX, and kernels that no graph of ours reaches (attention of language models, mixtures of experts) become
zeros in place, so that all addresses stay and the file packs to a tenth. CUDA loads an entry when a kernel of it is
first used. Libraries without such sections are copied. Needs `zstandard` (pip), since entries are compressed.
"""

from __future__ import annotations

import re
import shutil
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

MAGIC = 0xBA55ED50
CUBIN = 2
UNREACHED = re.compile(
    rb"MoeFCGemm|flash|fpA_intB|moe|GroupProblemShape|attention_kernel_batched|SaveNoSpeech|3llm|paged|[fF]mha"
)
NAME = re.compile(rb"\.text\.([A-Za-z0-9_]{10,400})")


def fat_sections(data: bytes) -> Iterator[tuple[int, int]]:
    """Offset and size of the sections of a 64-bit ELF file that hold device code."""
    (table,) = struct.unpack_from("<Q", data, 0x28)
    size, count, names = struct.unpack_from("<HHH", data, 0x3A)
    rows = [struct.unpack_from("<IIQQQQ", data, table + i * size) for i in range(count)]
    strings = rows[names][4]
    for name, _, _, _, offset, length in rows:
        start = strings + name
        if data[start : data.index(0, start)] in (b".nv_fatbin", b"__nv_relfatbin"):
            yield offset, length


def entries(data: bytes, offset: int, length: int) -> Iterator[tuple[int, int, int, int]]:
    """Kind, architecture, offset and size of each entry's code in a section."""
    at = offset
    while at < offset + length:
        magic, _, header, size = struct.unpack_from("<IHHQ", data, at)
        if magic != MAGIC:  # between two blobs
            at += 8
            continue
        entry, end = at + header, at + header + size
        while entry < end:
            kind, _, own, code = struct.unpack_from("<HHIQ", data, entry)
            (architecture,) = struct.unpack_from("<I", data, entry + 28)
            yield kind, architecture, entry + own, code
            entry += own + code
        at = end


def main(library: str, out: str, architecture: str) -> None:
    whole = Path(library).read_bytes()
    sections = list(fat_sections(whole))
    if not sections:
        shutil.copyfile(library, out)
        return
    try:
        import zstandard
    except ImportError:
        sys.exit("prune.py: needs the Python package zstandard: pip install zstandard")
    pruned, kept = bytearray(whole), 0
    for section in sections:
        for kind, found, offset, size in entries(whole, *section):
            if kind == CUBIN and found == int(architecture):
                code = zstandard.ZstdDecompressor().decompressobj().decompress(whole[offset : offset + size])
                if not UNREACHED.search(b" ".join(NAME.findall(code))):
                    kept += size
                    continue
            pruned[offset : offset + size] = bytes(size)
    if kept == 0:
        sys.exit(f"prune.py: {library} has no device code for architecture {architecture}")
    Path(out).write_bytes(pruned)
    print(f"{Path(library).name}: {kept / 2**20:.1f} MiB of device code kept")


if __name__ == "__main__":
    main(*sys.argv[1:])
