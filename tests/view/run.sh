#!/usr/bin/env bash
# `upt view`: see run.py.
set -euo pipefail
exec python3 "$(dirname "${BASH_SOURCE[0]}")/run.py"
