# Sourced by arm64.sh: Debian's Python for arm64 with NumPy, ONNX Runtime and pytest, unpacked below target/cross and never installed.
#
# debian_python FOLDER: fills it, once.
debian_python() {
  local folder="$1" apt="$1/apt"
  [ -e "$folder/ready" ] && return
  rm -rf "$folder"
  mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial" "$apt/state" "$folder/debs" "$folder/root"
  cat >"$apt/apt.conf" <<CONF
APT::Architecture "amd64";
APT::Architectures { "amd64"; "arm64"; };
APT::Sandbox::User "";
Dir::State "$apt/state";
Dir::State::Lists "$apt/lists";
Dir::State::status "/var/lib/dpkg/status";
Dir::Cache "$apt/cache";
CONF
  (
    export APT_CONFIG="$apt/apt.conf"
    apt-get update -q
    cd "$folder/debs"
    local version
    version="$(apt-cache depends python3:arm64 | sed -n 's/^ *Depends: \(python3\.[0-9]*\):arm64$/\1/p')"
    apt-get download -q "$version-minimal:arm64" "lib$version-minimal:arm64" "lib$version-stdlib:arm64" \
      libexpat1:arm64 zlib1g:arm64 libffi8:arm64 libssl3:arm64 libbz2-1.0:arm64 liblzma5:arm64
    for deb in *.deb; do dpkg-deb -x "$deb" "$folder/root"; done
    ln -s "$version" "$folder/root/usr/bin/python3"
    local pip=("${UPT_PYTHON:-python3}" -m pip install --quiet --disable-pip-version-check --target "$folder/packages"
      --platform manylinux_2_28_aarch64 --platform manylinux_2_17_aarch64 --python-version "${version#python}"
      --only-binary=:all:)
    "${pip[@]}" numpy pytest
    "${pip[@]}" --no-deps onnxruntime
  ) >"$folder/log" 2>&1 || { cat "$folder/log"; return 1; }
  rm -r "$folder/debs" "$apt"
  touch "$folder/ready"
}
