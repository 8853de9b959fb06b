"""Fields of the ABI's structs as Python sees them."""

import pytest
from upt import _native


@pytest.mark.parametrize(("given", "raw"), [(None, 0), (True, 1), (False, 2)])
def test_a_switch_is_on_off_or_as_usual(given: bool | None, raw: int) -> None:
    options = _native.SceneOptions(sleep=given)
    assert (options.sleep, options._sleep) == (given, raw)
    assert _native.SceneOptions().sleep is None
