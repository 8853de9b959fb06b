#!/usr/bin/env bash
# The first page for Unity, as far as it goes without the editor: first_page.sh PACKAGE.tgz WORK. The package's own sources are compiled with Mono against a
# stub of the engine, what the page names is looked for in the package, and its steps are taken by FirstPage.cs with the package's library and bundle.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
package="$2/package"
mkdir -p "$2/assets" "$2/bin"
tar -xzf "$1" -C "$2"
page="$package/Documentation~/index.md"

# said WORDS FILE WHAT: the page says WORDS, and FILE has WHAT.
said() {
  grep -qF "$1" "$page" || { echo "the page does not say: $1"; exit 1; }
  grep -qF "$3" "$package/$2" || { echo "the page says $1, but $2 has no: $3"; exit 1; }
}
said 'Assets > Create > libupt > Model' Runtime/Components/UptModel.cs 'menuName = "libupt/Model"'
said 'Path* at `brain`' Runtime/Components/UptModel.cs 'bundlePath = "brain"'
said 'Samples > Pushed Brain > Import' package.json '"displayName": "Pushed Brain"'
said 'add the component `PushedBrain`' Samples~/PushedBrain/PushedBrain.cs 'class PushedBrain : MonoBehaviour'
said 'Samples > Haptic Probe > Import' package.json '"displayName": "Haptic Probe"'
said '`Bundles~/brain` of the package' Bundles~/brain/bundle.json '"name": "brain"'

flags=(-langversion:7.2 -unsafe -nologo -debug- -optimize+ -nowarn:0649,0067,0169)
mcs "${flags[@]}" -target:library -out:"$2/bin/Upt.Interop.dll" "$package"/Runtime/Interop/*.cs
mcs "${flags[@]}" -target:library -out:"$2/bin/UnityEngine.Stub.dll" "$here"/stub/*.cs
mcs "${flags[@]}" -target:exe -out:"$2/bin/FirstPage.exe" -r:"$2/bin/Upt.Interop.dll" -r:"$2/bin/UnityEngine.Stub.dll" \
  "$package"/Runtime/Components/*.cs "$package"/Samples~/PushedBrain/*.cs "$here/FirstPage.cs"
cp -r "$package/Bundles~/brain" "$2/assets/brain"
libraries="$(dirname "$(find "$package/Runtime/Plugins" -name libupt.so)")"
LD_LIBRARY_PATH="$libraries" mono "$2/bin/FirstPage.exe" "$2/assets"
