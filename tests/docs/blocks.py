"""Compiles the code blocks of a page that are marked, as in "```c complete".

A `complete` block of C or C++ is a program: it is compiled with warnings as errors, linked with libupt and run with a
bundle. A `body` block is the inside of a function, after the includes. A `complete` block of Python is run. Blocks
without a mark are fragments.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import markdown

ROOT = Path(__file__).resolve().parents[2]
BUNDLE = ROOT / "onnx/brain-coarse-reduced"
COMPILERS = {"c": ("cc", "-std=c99"), "cpp": ("c++", "-std=c++17")}
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wno-missing-field-initializers"]
# What a `body` block may take for granted.
BODY = {
    "c": "#include <stdio.h>\n#include <stdlib.h>\n#include <upt.h>\n\nvoid body(void);\nvoid body(void) {{\n{}\n}}\n",
    "cpp": "#include <cstdio>\n#include <vector>\n#include <upt.hpp>\n\nvoid body();\nvoid body() {{\n{}\n}}\n",
}


def marked(page: markdown.Page) -> list[markdown.Block]:
    """The blocks to try."""
    return [block for block in page.blocks if {"complete", "body"} & set(block.marks)]


def fault(page: markdown.Page, block: markdown.Block, work: Path, release: Path) -> str:
    """What is wrong with a block; empty where nothing is."""
    where = f"{page.path}:{block.line}"
    if block.language in COMPILERS:
        commands = native(block, work / f"{page.path.stem}-{block.line}", release)
    elif block.language == "python" and "complete" in block.marks:
        commands = [[sys.executable, "-W", "error", "-c", block.text]]
    else:
        return f"{where}: a block of `{block.language}` cannot be {' '.join(block.marks)}"
    environment = dict(os.environ, PYTHONPATH=str(ROOT / "python"), UPT_LIBRARY=str(release / "libupt.so"))
    for command in commands:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return f"{where}: {' '.join(command[:2])} ... ended with {done.returncode}\n{done.stdout}{done.stderr}"
    return ""


def native(block: markdown.Block, base: Path, release: Path) -> list[list[str]]:
    """The commands that compile a block of C or C++, and run it where it is a program."""
    program, standard = COMPILERS[block.language]
    complete = "complete" in block.marks
    source = base.with_suffix(f".{block.language}")
    source.write_text(block.text if complete else BODY[block.language].format(block.text), encoding="utf-8")
    compiled = [program, standard, *WARNINGS, f"-I{ROOT / 'include'}", str(source)]
    if not complete:
        return [[*compiled, "-fsyntax-only"]]
    # A program asks for the library by its soname, which only an installed one has as a file.
    folder = base.parent / "lib"
    folder.mkdir(exist_ok=True)
    for name in ("libupt.so", "libupt.so.0"):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(release / "libupt.so")
    linked = [*compiled, "-o", str(base), f"-L{folder}", "-lupt", "-lm", f"-Wl,-rpath,{folder}"]
    return [linked, [str(base), str(BUNDLE)]]
