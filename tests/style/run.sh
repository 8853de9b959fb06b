#!/usr/bin/env bash
# What no compiler checks: formatters, and the rules of tests/style/*.py. `cargo xtask test --only style` sets UPT_PYTHON, the
# interpreter beside which ruff and clang-format are installed. The last line: N passed, N failed, N skipped.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1
source tests/cross/count.sh
python="${UPT_PYTHON:-target/venv/bin/python}"
programs="$(dirname "$python")"

# The generated header is compared with a fresh generation instead.
c_files() { git ls-files '*.c' '*.h' '*.cpp' '*.hpp' | grep -vx include/upt.h; }
clang_format() { c_files | xargs "$programs/clang-format" --dry-run --Werror; }

check "ruff check" "$programs/ruff" check
check "ruff format" "$programs/ruff" format --check
check clang-format clang_format
for rule in tests/style/*.py; do
  check "$rule" "$python" "$rule"
done

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
