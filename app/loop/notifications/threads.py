"""Work that another server may hold up for ever: each piece in a thread of its own, as many at a time as there are slots."""

from collections.abc import Callable
from concurrent.futures import Future
from contextvars import copy_context
from functools import partial
from threading import BoundedSemaphore, Thread
from typing import TypeVar

Result = TypeVar("Result")


def begun(slots: BoundedSemaphore, name: str, work: Callable[[], Result]) -> Future[Result] | None:
    """Begin the work in a thread of its own; None while all slots are taken by work that hangs."""
    if not slots.acquire(blocking=False):
        return None
    result = Future[Result]()
    result.set_running_or_notify_cancel()  # who stops waiting stops no work

    def run() -> None:
        try:
            settle = partial(result.set_result, work())
        except Exception as error:  # noqa: BLE001 - raised where it is waited for
            settle = partial(result.set_exception, error)
        finally:
            slots.release()
        settle()

    Thread(target=copy_context().run, args=(run,), name=name, daemon=True).start()
    return result
