"""Writes a benchmark's lines between the marks of a page."""

from __future__ import annotations

import datetime
import os
import platform
from pathlib import Path

import upt


def machine() -> str:
    """Processor, cores that may be used, date."""
    name = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        names = [line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
        name = names[0].split(":")[1].strip() if names else name
    return f"{name} ({upt.batch.core_count()} cores, load {os.getloadavg()[0]:.1f} before), {datetime.date.today()}"


def write(page: Path | None, command: str, text: str) -> None:
    """Prints `text`, and puts it between `<!-- begin: command -->` and its end in `page`."""
    print(text)
    if page:
        begin, end = f"<!-- begin: {command} -->", f"<!-- end: {command} -->"
        head, rest = page.read_text().split(begin, 1)
        page.write_text(f"{head}{begin}\n{text}\n\n{end}{rest.split(end, 1)[1]}")
