"""`compiled`: a loop over many readings, run as machine code (Numba) and equal to the Python that it is written in.

Compiled code is kept beside the source (``__pycache__``), where that cannot be written in the user's cache folder, or where
``NUMBA_CACHE_DIR`` says, which the server sets to a folder of its data (app.cli.serve); where nothing can be written it is
compiled again by each process. The first call of a process takes some milliseconds from the cache, and some seconds the very
first time.

A compiled function may call functions of ours in any file: they are compiled into it, and stay plain for anyone else who calls
them. What is kept is renewed when one of those files changes, so constants are taken from them and from no other file (a
test holds that). The interpreter's lock is let go while the code runs, so a page of a million readings holds nobody up:
never give it an array that another thread writes.
"""

import inspect
import sys
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from types import FunctionType
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.extending import overload, register_jitable

F = TypeVar("F", bound=Callable[..., Any])
_COMPILED_INTO: set[Callable[..., Any]] = set()


def functions_of(function: Callable[..., Any]) -> list[FunctionType]:
    """Return a function and all functions of its package that it calls, directly or not."""
    package = function.__module__.partition(".")[0]
    functions = [function]
    for caller in functions:
        for name in caller.__code__.co_names:
            called = caller.__globals__.get(name)
            called = getattr(called, "py_func", called)
            if isinstance(called, FunctionType) and called not in functions:
                functions += [called] if called.__module__.partition(".")[0] == package else []
    return cast("list[FunctionType]", functions)


class _CacheImpl(CompileResultCacheImpl):
    """Numba's, stamped with the text of all files that the code is made from, not of one alone."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        modules = sorted({part.__module__ for part in functions_of(function)})
        stamp = [sha256(inspect.getsource(sys.modules[name]).encode()).digest() for name in modules]
        self.locator.get_source_stamp = lambda: stamp


class _Cache(FunctionCache):
    _impl_class = _CacheImpl


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
    for called in functions_of(function)[1:]:
        if called not in _COMPILED_INTO:
            _COMPILED_INTO.add(called)
            register_jitable(forceinline=True)(called)
    dispatcher = njit(function, nogil=True)
    with suppress(RuntimeError):  # no folder can be written
        dispatcher._cache = _Cache(function)  # type: ignore[no-untyped-call]  # noqa: SLF001 - as its enable_caching does
    return cast("F", dispatcher)


def compiled_form_of(function: Callable[..., Any]) -> Callable[[F], F]:
    """Compile another function wherever compiled functions call this one: it says the same by what Numba can do."""

    def register(form: F) -> F:
        _COMPILED_INTO.add(function)
        overload(function, jit_options={"forceinline": True}, strict=False)(lambda *_types: form)
        return compiled(form)

    return register


def plain(function: F) -> F:
    """The Python that a compiled function was made from, to hold it against."""
    return cast("F", function.py_func)  # type: ignore[attr-defined]
