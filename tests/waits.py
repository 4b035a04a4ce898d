"""Wait for an event: however busy the computer is, it comes."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def until(look: Callable[[], T], seconds: float = 60) -> T:
    """What it finds, once that is true. It looks the less often the longer it takes: to look takes processor from what it waits for."""
    began = time.monotonic()
    while not (found := look()):
        waited = time.monotonic() - began
        assert waited < seconds, f"not within {seconds} s: {found!r}"
        time.sleep(min(0.03 + waited / 10, 0.5))
    return found
