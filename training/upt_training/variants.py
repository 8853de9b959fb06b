"""A copy of a bundle with half-precision and int8 graphs beside its float32 ones, to compare precisions.

`python -m upt_training variants onnx/brain-fast --f16 --int8 --out target/narrow`; needs nothing but the bundle.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from upt_training.bundle_folder import MANIFEST, copy_whole, read_manifest, write_manifest
from upt_training.errors import InputError
from upt_training.precision import write_variant


def variants_command(options: argparse.Namespace) -> int:
    wanted = [name for name, asked in (("f16", options.f16), ("int8", options.int8)) if asked]
    if not wanted:
        raise InputError("variants: say which, --f16 or --int8 or both")
    make_variants(options.bundle, options.out, wanted)
    print(f"{options.out}: {', '.join(['f32', *wanted])}")
    return 0


def make_variants(bundle: Path, out: Path, precisions: list[str]) -> None:
    """Copy `bundle` to the new folder `out` and add the graphs of `precisions` to it and to its manifest."""
    manifest = read_manifest(bundle)
    if out.exists():
        raise InputError(f"{out}: exists; variants are written to a new folder")
    if manifest["kind"] != "upt":
        raise InputError(
            f"{bundle / MANIFEST}: kind `{manifest['kind']}` has no graphs worth narrowing; give a `upt` one"
        )
    out.mkdir(parents=True)
    copy_whole(bundle, manifest, out)
    for precision in precisions:
        write_variant(out, precision)
    manifest["precisions"] = sorted({"f32", *manifest["precisions"], *precisions})
    write_manifest(out, manifest)
