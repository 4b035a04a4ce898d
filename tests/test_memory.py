"""Memory of a server process."""

import gc

import pytest

from app.memory import reading_modules


@pytest.mark.parametrize("on", [True, False])
def test_nothing_is_collected_while_modules_are_read_and_all_as_before_from_then_on(on: bool) -> None:
    before = gc.isenabled()
    (gc.enable if on else gc.disable)()
    try:
        with pytest.raises(ImportError), reading_modules():
            assert not gc.isenabled()
            raise ImportError
        assert gc.isenabled() is on
    finally:
        (gc.enable if before else gc.disable)()
