"""Memory and turns of a process: what is free goes back to the system, and long work gives way.

Pages, charts and reports take some megabytes each for a moment, in threads. glibc keeps what is freed: an arena for every few
threads, with holes that the next request does not fit into, so a server that stores nothing in memory grows for hours. With few
arenas, large blocks taken straight from the system, and the free rest given back once a minute it comes to rest. Other
systems' libraries do that by themselves; there nothing is done here.
"""

import asyncio
import ctypes
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

ARENAS = 2  # more of them help only threads that allocate at the same time, which Python's own lock keeps from it
LARGE = 512 * 1024  # bytes from which a block comes from the system and goes back when it is freed
EVERY = 60.0  # s between two times that free memory is given back
_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8  # of malloc.h
NICE = 10
BEHIND = f"import os; hasattr(os, 'nice') and os.nice({NICE})"
"""First words of the program of a process for long work: it gives way to its server, so that readings go first. To read the
modules takes such a process longer than many a task."""


def give_way() -> None:
    """Let this thread, and those that it starts, compute after others. Linux only: elsewhere the whole process would give way."""
    if sys.platform == "linux":
        os.nice(NICE)


@cache
def _glibc() -> ctypes.CDLL | None:
    try:
        library = ctypes.CDLL("libc.so.6")
        return library if hasattr(library, "malloc_trim") and hasattr(library, "mallopt") else None
    except OSError:
        return None


def keep_few_arenas() -> None:
    """Set how this process takes memory; to be called before it has many threads."""
    if (library := _glibc()) is not None:
        library.mallopt(_M_ARENA_MAX, ARENAS)
        library.mallopt(_M_MMAP_THRESHOLD, LARGE)


@contextmanager
def reading_modules() -> Iterator[None]:
    """While a program reads its modules all that they make is there to stay: no round of garbage collection looks at it.

    A quarter of the start of a server went into such rounds.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


async def give_back_free_memory() -> None:
    """Give it back again and again, until cancelled; in a thread, which lets everybody else go on."""
    library = _glibc()
    while library is not None:
        await asyncio.to_thread(
            library.malloc_trim, 0
        )  # first what starting has left: reading modules takes more than they keep
        await asyncio.sleep(EVERY)
