#!/usr/bin/env bash
# exports.sh DLL HEADER: the dll exports each function of the header, and nothing else that begins with upt_.
set -euo pipefail
exported="$(x86_64-w64-mingw32-objdump -p "$1" | sed -n 's/^.*\[ *[0-9]*\].* \(upt_[a-z_]*\)$/\1/p' | sort -u)"
declared="$(sed -n 's/^[a-z].*[ *]\(upt_[a-z_]*\)(.*/\1/p' "$2" | sort -u)"
diff <(echo "$declared") <(echo "$exported")
