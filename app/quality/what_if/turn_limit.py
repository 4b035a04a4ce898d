"""Replays take turns: two at once, some wait, who comes after that is asked to come again.

A replay keeps a core busy for up to some seconds. It lets the interpreter go meanwhile, so readings are taken as ever.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import BoundedSemaphore
from typing import TypeVar

from app.errors import TooManyRequests
from app.language.i18n import _

AT_ONCE, WAITING = 2, 4
PATIENCE = 15.0  # s
AGAIN = 5  # s
CORES = 2  # that one map may use

_running = BoundedSemaphore(AT_ONCE)
_inside = BoundedSemaphore(AT_ONCE + WAITING)
Item = TypeVar("Item")
Result = TypeVar("Result")


@contextmanager
def turn(patience: float = PATIENCE) -> Iterator[None]:
    """Wait for one's turn. Raises `TooManyRequests` where too many wait already, or nobody leaves in time."""
    if not _inside.acquire(blocking=False):
        raise _busy()
    try:
        if not _running.acquire(timeout=patience):
            raise _busy()
        try:
            yield
        finally:
            _running.release()
    finally:
        _inside.release()


def _busy() -> TooManyRequests:
    return TooManyRequests(
        _("Other simulations are running."),
        _("Wait for {seconds} seconds and ask again, or ask for fewer readings.").format(seconds=AGAIN),
        retry_after=AGAIN,
    )


def on_all_cores(work: Callable[[Sequence[Item]], list[Result]], items: Sequence[Item]) -> list[Result]:
    """`work` on every item, shared between the cores; the answers in the order of the items."""
    shares = [items[at::CORES] for at in range(CORES)]
    with ThreadPoolExecutor(CORES) as pool:
        done = list(pool.map(work, shares))
    return [done[at % CORES][at // CORES] for at in range(len(items))]
