# Sourced by run.sh: the Python wheel with the library that was built for the platform.

# make_wheel LIBRARY TAG: the wheel, unpacked in $build/wheel.
make_wheel() {
  rm -rf "$build/wheels" "$build/wheel"
  UPT_WHEEL_LIBRARY="$1" UPT_WHEEL_PLATFORM="$2" "${UPT_PYTHON:-python3}" -m pip wheel --quiet \
    --disable-pip-version-check --no-deps --wheel-dir "$build/wheels" "$root/python" >"$build/wheel.log" 2>&1 || cat "$build/wheel.log"
  python3 -m zipfile -e "$build"/wheels/*.whl "$build/wheel"
  echo "made $(basename "$build"/wheels/*.whl)"
}
