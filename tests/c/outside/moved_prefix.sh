# An installed tree works from another place.   moved_prefix.sh PREFIX CC
set -eu
here="$(cd "$(dirname "$0")" && pwd)"
rm -rf moved
mkdir moved
cp -a "$1" moved/elsewhere
sh "$here/pkg_config.sh" moved/elsewhere "$2"
cmake -S "$here" -B moved/build -DCMAKE_PREFIX_PATH="$PWD/moved/elsewhere" >moved/log
cmake --build moved/build --target version_shared >>moved/log
./moved/build/version_shared
