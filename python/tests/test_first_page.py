"""The first page works word for word: with the wheel alone where it is installed, else with the clone."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"


def test_the_readmes_first_program_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """It prints how far the tissue went, and the force."""
    program = re.search(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert program is not None
    exec(compile(program[1], str(README), "exec"), {})
    largest, *force = (float(number) for number in re.findall(r"-?\d+\.?\d*", capsys.readouterr().out)[:4])
    assert 5.5 < largest < 7.0, "pushed by 6 mm"
    assert max(abs(component) for component in force) > 1.0, "a push of 6 mm is felt"
