"""Unity's .meta files of the package: GUIDs that follow from the path, importer settings for native libraries.

`meta.py` writes what is missing; `meta.py --check` fails when a file has no .meta, or a .meta no file.
Native libraries are not committed, their .meta files are: `cargo xtask package --unity` fills in the libraries.
"""

import argparse
import hashlib
import pathlib
import sys

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "unity-plugin"

# library -> (editor OS, CPU, build target)
NATIVE = {
    "Runtime/Plugins/Linux/x86_64/libupt.so": ("Linux", "x86_64", "Linux64"),
    "Runtime/Plugins/Linux/x86_64/libonnxruntime.so": ("Linux", "x86_64", "Linux64"),
    "Runtime/Plugins/Windows/x86_64/upt.dll": ("Windows", "x86_64", "Win64"),
    "Runtime/Plugins/Windows/x86_64/onnxruntime.dll": ("Windows", "x86_64", "Win64"),
    "Runtime/Plugins/macOS/arm64/libupt.dylib": ("OSX", "ARM64", "OSXUniversal"),
    "Runtime/Plugins/macOS/arm64/libonnxruntime.dylib": ("OSX", "ARM64", "OSXUniversal"),
}


def guid(path: str) -> str:
    return hashlib.md5(f"org.libupt.soft-tissue/{path}".encode()).hexdigest()


def head(path: str) -> str:
    return f"fileFormatVersion: 2\nguid: {guid(path)}\n"


def tail() -> str:
    return "  externalObjects: {}\n  userData: \n  assetBundleName: \n  assetBundleVariant: \n"


def plugin() -> list[str]:
    """A plugin of no platform yet."""
    rows = ["PluginImporter:", "  externalObjects: {}", "  serializedVersion: 2", "  isPreloaded: 0"]
    rows += ["  isOverridable: 0", "  isExplicitlyReferenced: 0", "  validateReferences: 1", "  platformData:"]
    return [*rows, "  - first:", "      Any: ", "    second:", "      enabled: 0", "      settings: {}"]


def jslib() -> str:
    """What Emscripten links into WebGL players, and the editor does not load."""
    rows = plugin()
    rows += ["  - first:", "      Editor: Editor", "    second:", "      enabled: 0", "      settings:"]
    rows += ["        DefaultValueInitialized: true"]
    rows += ["  - first:", "      WebGL: WebGL", "    second:", "      enabled: 1", "      settings: {}"]
    return "\n".join([*rows, "  userData: ", "  assetBundleName: ", "  assetBundleVariant: ", ""])


def native(path: str) -> str:
    system, cpu, target = NATIVE[path]
    rows = plugin()
    rows += ["  - first:", "      Editor: Editor", "    second:", "      enabled: 1", "      settings:"]
    rows += [f"        CPU: {cpu}", f"        OS: {system}"]
    rows += ["  - first:", f"      Standalone: {target}", "    second:", "      enabled: 1", "      settings:"]
    rows += [f"        CPU: {cpu}", "  userData: ", "  assetBundleName: ", "  assetBundleVariant: ", ""]
    return "\n".join(rows)


def content(path: str, folder: bool) -> str:
    if path in NATIVE:
        return head(path) + native(path)
    if path.endswith(".jslib"):
        return head(path) + jslib()
    if folder:
        return head(path) + "folderAsset: yes\nDefaultImporter:\n" + tail()
    if path.endswith(".cs"):
        body = "MonoImporter:\n  externalObjects: {}\n  serializedVersion: 2\n  defaultReferences: []\n"
        body += "  executionOrder: 0\n  icon: {instanceID: 0}\n"
        return head(path) + body + "  userData: \n  assetBundleName: \n  assetBundleVariant: \n"
    if path.endswith(".asmdef"):
        return head(path) + "AssemblyDefinitionImporter:\n" + tail()
    if path == "package.json":
        return head(path) + "PackageManifestImporter:\n" + tail()
    return head(path) + "TextScriptImporter:\n" + tail()


def assets() -> dict[str, bool]:
    """Paths that Unity imports (folders ending in ~ are not), with True for folders."""
    found: dict[str, bool] = {}
    for entry in sorted(PACKAGE.rglob("*")):
        path = entry.relative_to(PACKAGE)
        hidden = any(part.endswith("~") or part.startswith(".") for part in path.parts)
        if hidden or entry.suffix == ".meta":
            continue
        found[path.as_posix()] = entry.is_dir()
    for library in NATIVE:
        found[library] = False
        for parent in pathlib.PurePosixPath(library).parents:
            if parent.as_posix() != ".":
                found[parent.as_posix()] = True
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    wanted = {path + ".meta": content(path, folder) for path, folder in assets().items()}
    present = {entry.relative_to(PACKAGE).as_posix() for entry in PACKAGE.rglob("*.meta")}
    problems = [f"{path}: a .meta without its file" for path in sorted(present - set(wanted))]
    for path, text in wanted.items():
        target = PACKAGE / path
        if path in present and target.read_text() == text:
            continue
        if check:
            problems.append(f"{path}: missing or changed; run tests/csharp/meta.py")
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text)
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
