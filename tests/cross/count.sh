# Sourced by run.sh: what passed, failed and was left out, with a line for each.
passed=0
failed=0
skipped=0

# pass WHAT, fail WHAT
pass() {
  passed=$((passed + 1))
  echo "passed: $1"
}
fail() {
  failed=$((failed + 1))
  echo "FAILED: $1"
}

# leave_out COUNT WHAT
leave_out() {
  skipped=$((skipped + $1))
  echo "skipped: $1 $2"
}

# check WHAT COMMAND...: passes where the command does.
check() {
  local what="$1"
  shift
  if "$@"; then pass "$what"; else fail "$what"; fi
}

# The `test result:` lines of cargo's log $1.
count_cargo() {
  local ok bad ignored
  ok="$(sed -n 's/^test result:.* \([0-9]*\) passed.*/\1/p' "$1" | awk '{s += $1} END {print s + 0}')"
  bad="$(sed -n 's/^test result:.* \([0-9]*\) failed.*/\1/p' "$1" | awk '{s += $1} END {print s + 0}')"
  ignored="$(sed -n 's/^test result:.* \([0-9]*\) ignored.*/\1/p' "$1" | awk '{s += $1} END {print s + 0}')"
  # A program that ended without a result, or did not build.
  if grep -qE '^error' "$1" && [ "$bad" -eq 0 ]; then bad=1; fi
  if [ "$ok" -eq 0 ]; then bad=$((bad + 1)); fi
  if [ "$bad" -gt 0 ]; then grep -E 'FAILED|panicked|^error|failed' "$1" | head -n 40 || true; fi
  passed=$((passed + ok))
  failed=$((failed + bad))
  skipped=$((skipped + ignored))
  echo "$ok passed, $bad failed, $ignored ignored"
}

# The result lines of ctest's log $1.
count_ctest() {
  local ok total
  ok="$(grep -cE '^ *[0-9]+/[0-9]+ Test .* Passed ' "$1" || true)"
  total="$(grep -cE '^ *[0-9]+/[0-9]+ Test ' "$1" || true)"
  passed=$((passed + ok))
  failed=$((failed + total - ok))
  if [ "$total" -eq 0 ]; then failed=$((failed + 1)); fi
  if [ "$ok" -ne "$total" ] || [ "$total" -eq 0 ]; then tail -n 60 "$1"; fi
  echo "$ok of $total C and C++ tests passed"
}

# The last line of pytest's log $1.
count_pytest() {
  local ok bad
  ok="$(tail -n 1 "$1" | { grep -oE '[0-9]+ passed' || true; } | cut -d' ' -f1)"
  bad="$(tail -n 1 "$1" | { grep -oE '[0-9]+ (failed|error)' || true; } | awk '{s += $1} END {print s + 0}')"
  if [ -z "$ok" ] && [ "$bad" -eq 0 ]; then bad=1; fi
  if [ "$bad" -gt 0 ]; then tail -n 60 "$1"; fi
  passed=$((passed + ${ok:-0}))
  failed=$((failed + bad))
  echo "${ok:-0} passed, $bad failed (pytest of the wheel)"
}

# What `upt doctor` (its output is $1) says about the lanes of the kernels that ran.
lanes() {
  local ran
  ran="$(sed -n 's/^.*kernels \([a-z0-9]*\).*$/\1/p' <<<"$1" | head -n 1)"
  check "lanes that ran: ${ran:-none}, and scalar ones beside them in the unit tests" test -n "$ran"
}
