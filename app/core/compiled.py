"""`compiled`: a loop over many readings, run as machine code (Numba) and equal to the Python that it is written in.

Compiled code is kept beside the source (``__pycache__``), where that cannot be written in the user's cache folder, or where
``NUMBA_CACHE_DIR`` says; where nothing can be written it is compiled anew by each process. The first call
of a process takes some milliseconds from the cache, and some seconds the very first time.

Two rules. The interpreter's lock is let go while the code runs, so a page of a million readings holds nobody up: never
give it an array that another thread writes. And a compiled function calls only compiled functions of its own file,
because what is kept is renewed when this file changes, not when another does (a test holds that).
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile a function on its first call, for the types it is called with.

    >>> @compiled
    ... def total(values: tuple[float, ...]) -> float:
    ...     result = 0.0
    ...     for value in values:
    ...         result += value
    ...     return result
    >>> total((0.5, 0.25)) == plain(total)((0.5, 0.25)) == 0.75
    True
    """
    try:
        return cast("F", njit(function, cache=True, nogil=True))
    except RuntimeError:  # no folder can be written
        return cast("F", njit(function, nogil=True))


def plain(function: F) -> F:
    """The Python that a compiled function was made from, to hold it against."""
    return cast("F", function.py_func)  # type: ignore[attr-defined]
