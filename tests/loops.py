"""Running coroutines in tests: in a thread of their own, because Playwright keeps a loop running in the main one."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any, TypeVar

Result = TypeVar("Result")
LIMIT = 600.0  # s: what hangs fails, and holds up no other test


def in_thread(call: Callable[[], Result]) -> Result:
    """The result of a call that runs a loop of its own."""
    done: Future[Result] = Future()

    def work() -> None:
        try:
            done.set_result(call())
        except BaseException as error:  # noqa: BLE001 - raised where it is waited for
            done.set_exception(error)

    threading.Thread(target=work, daemon=True).start()
    return done.result(LIMIT)


def run(coroutine: Coroutine[Any, Any, Result]) -> Result:
    """The result of a coroutine."""
    return in_thread(lambda: asyncio.run(coroutine))
