"""Running coroutines in tests: in a thread of their own, because Playwright keeps a loop running in the main one."""

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")


def in_thread(call: Callable[[], Result]) -> Result:
    """The result of a call that runs a loop of its own."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()


def run(coroutine: Coroutine[Any, Any, Result]) -> Result:
    """The result of a coroutine."""
    return in_thread(lambda: asyncio.run(coroutine))
