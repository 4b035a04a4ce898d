"""What holds for all tests of the bridge."""

import pytest

from app.bridge import control_side


@pytest.fixture(autouse=True)
def quick_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A control that was away is tried again soon: at once it would be no pause at all."""
    monkeypatch.setattr(control_side, "FIRST_PAUSE", 0.05)
