"""Copies ONNX Runtime's library so that the copy never takes AVX-512: a rival as on a CPU that has AVX2 alone.

    python3 benches/onnxruntime_avx2.py LIBONNXRUNTIME.SO COPY.SO
    ORT_DYLIB_PATH=COPY.SO UPT_ISA=avx2 cargo xtask bench --only step --part paper

MLAS, its kernels, asks the CPU for AVX512F (bit 16 of EBX of leaf 7) and offers no other switch; in the copy the branch
behind that test is always taken. For measurements: nothing of it is shipped.
"""

import sys
from pathlib import Path

# test r10d, 0x10000; je over the kernels for AVX-512
TEST = bytes.fromhex("41f7c20000010074")
ALWAYS = 0xEB  # jmp


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source, copy = map(Path, sys.argv[1:])
    code = bytearray(source.read_bytes())
    found = code.count(TEST)
    if found != 1:
        sys.exit(f"{source}: {found} tests for AVX512F, not one as in 1.32.0 for Linux x86-64")
    code[code.find(TEST) + len(TEST) - 1] = ALWAYS
    copy.write_bytes(code)


if __name__ == "__main__":
    main()
