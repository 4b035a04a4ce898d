"""The event loop of the bridge, and how it ends: the same on Linux and on Windows.

Windows' own loop, the proactor, knows no ``add_reader``, which the MQTT library needs; and no loop there knows
``add_signal_handler``. So the loop is the selector's everywhere, and signals are Python's own.
"""

import asyncio
import signal
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, Final, TypeVar

T = TypeVar("T")
NAMES: Final = ("SIGINT", "SIGTERM", "SIGBREAK")
"""Ctrl-C, which service managers of Windows send too; the end of a service of systemd; the closing of a console."""
TICK = 0.5  # s: Windows breaks no waiting off for a signal, so one that came is seen when the loop next looks up


def run_selecting(work: Coroutine[Any, Any, T]) -> T:
    """Run it to its end, as `asyncio.run` does."""
    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        return runner.run(work)


@contextmanager
def ended_by_signals(task: "asyncio.Task[None]") -> Iterator[None]:
    """Cancel the task when this process is asked to end."""
    loop = asyncio.get_running_loop()

    def end(_number: int, _frame: Any) -> None:
        loop.call_soon_threadsafe(task.cancel)

    async def tick() -> None:
        while True:  # noqa: ASYNC110 - there is nothing to wait for
            await asyncio.sleep(TICK)

    before = {number: signal.signal(number, end) for name in NAMES if (number := getattr(signal, name, None))}
    ticking = asyncio.create_task(tick())
    try:
        yield
    finally:
        ticking.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)
