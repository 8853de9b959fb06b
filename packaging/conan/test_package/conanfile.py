"""Builds the C example against the package, and runs it: on the bundle UPT_TEST_BUNDLE, or else to see its usage."""

import os
from pathlib import Path

from conan import ConanFile
from conan.tools.build import can_run
from conan.tools.cmake import CMake, cmake_layout


class TestLibupt(ConanFile):
    settings = "os", "arch", "compiler", "build_type"
    generators = "CMakeToolchain", "CMakeDeps", "VirtualRunEnv"

    def requirements(self):
        self.requires(self.tested_reference_str)

    def layout(self):
        cmake_layout(self)

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def test(self):
        if can_run(self):
            program = (Path(self.cpp.build.bindir) / "minimal").absolute()
            bundle = os.environ.get("UPT_TEST_BUNDLE")
            self.run(f"{program} {bundle} 20" if bundle else f"{program} 2>&1 | grep -i usage", env="conanrun")
