"""libupt from its release archive: the shared library beside ONNX Runtime. conandata.yml names archives by platform."""

from pathlib import Path

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.files import copy, get


class Libupt(ConanFile):
    name = "libupt"
    description = "Real-time soft tissue for game engines and simulators, behind a C ABI"
    license = "Apache-2.0 OR MIT"
    topics = ("simulation", "soft-tissue", "fem", "haptics", "physics")
    package_type = "shared-library"
    settings = "os", "arch", "compiler", "build_type"

    def set_version(self):
        self.version = self.version or next(iter(self.conan_data["sources"]))

    @property
    def _source(self):
        by_platform = self.conan_data["sources"][self.version]
        return by_platform.get(f"{self.settings.os}-{self.settings.arch}")

    def validate(self):
        if self._source is None:
            raise ConanInvalidConfiguration(f"libupt has no archive for {self.settings.os} {self.settings.arch}")

    def package_id(self):
        # A C ABI, built once for a platform.
        del self.info.settings.compiler
        del self.info.settings.build_type

    def build(self):
        get(self, **self._source, strip_root=True)

    def package(self):
        build, package = Path(self.build_folder), Path(self.package_folder)
        copy(self, "*.h*", build / "include", package / "include")
        copy(self, "lib*.so*", build / "lib", package / "lib")
        for name in ("LICENSE*", "NOTICE", "THIRD-PARTY.txt", "onnxruntime/*"):
            copy(self, name, build / "share/doc/upt", package / "licenses")

    def package_info(self):
        self.cpp_info.libs = ["upt"]
        self.cpp_info.set_property("cmake_file_name", "upt")
        self.cpp_info.set_property("cmake_target_name", "upt::upt")
        self.cpp_info.set_property("pkg_config_name", "upt")
