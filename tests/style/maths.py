"""No function of the standard library whose bits depend on the system (`f64::exp`, `sin`, ...) in what a step may run.

Portable models compute the same bits on every processor (docs/decisions/041-portable-bits.md); `libm` in Rust does.

What networks and hands compute is not portable and is excepted, file by file. Ends with 1 and a line for each fault.
"""

from __future__ import annotations

import re
import sys

from structure.rust import ROOT, Crate

LAYERS = "bundle contact elements exchange field implicit kernels lanes prior topology".split()
CRATES = [".", *(f"crates/{layer}" for layer in LAYERS)]

# Exact in IEEE 754, and so not among them: sqrt, mul_add, abs, floor. `powi` of a constant is products.
FUNCTIONS = (
    "exp exp2 exp_m1 ln ln_1p log log2 log10 sin cos tan sin_cos asin acos atan atan2 sinh cosh tanh asinh acosh atanh "
    "powf cbrt hypot"
).split()

EXCEPT = {
    "src/haptics/passivity.rs": "forces for hands run at another pace than steps: no step depends on them",
    "crates/kernels/src/decoder/scalar.rs": "the decoder of networks, which a portable model refuses",
    "crates/kernels/src/random.rs": "inputs of benches and tests",
}

CALL = re.compile(r"(?:\.|\bf(?:32|64)::)(" + "|".join(FUNCTIONS) + r")\s*\(")
# A path as a value, as in `map(f64::exp)`.
VALUE = re.compile(r"\bf(?:32|64)::(" + "|".join(FUNCTIONS) + r")\b(?!\s*\()")


def main() -> int:
    """Checks the crates that a step runs in."""
    faults, used, files = [], set(), 0
    for crate in CRATES:
        for source in Crate(ROOT / crate / "src").files.values():
            files += 1
            name = source.path.relative_to(ROOT).as_posix()
            found = sorted({hit.group(1) for rule in (CALL, VALUE) for hit in rule.finditer(source.text)})
            if found and name in EXCEPT:
                used.add(name)
            elif found:
                faults.append(f"{name}: {', '.join(found)} of the standard library; take libm's, the same everywhere")
    faults += [f"EXCEPT names {name}, which needs no exception" for name in EXCEPT if name not in used]
    print("\n".join(faults) or f"{files} files of steps, none computes what depends on the system")
    return min(len(faults), 1)


if __name__ == "__main__":
    sys.exit(main())
