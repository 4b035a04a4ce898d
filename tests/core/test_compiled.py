"""Compiled loops: the same as the Python they are made from, wherever the house is installed."""

import importlib
import pkgutil
from typing import Any

import numpy as np
import pytest
from numba.core.caching import CacheImpl
from numba.core.registry import CPUDispatcher

import app.core
from app.core.compiled import compiled, plain


def doubled(values: Any) -> Any:
    return values * 2.0


def compiled_functions() -> list[Any]:
    found = {}
    for module in pkgutil.walk_packages(app.core.__path__, "app.core."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, CPUDispatcher):
                found[value.py_func.__module__, value.py_func.__qualname__] = value
    return list(found.values())


def strangers(function: Any) -> list[str]:
    """Compiled functions of other files that this one calls: a change of theirs would not renew what is kept of it."""
    called = [function.py_func.__globals__.get(name) for name in function.py_func.__code__.co_names]
    return [
        f"{each.py_func.__module__}.{each.py_func.__qualname__}"
        for each in called
        if isinstance(each, CPUDispatcher) and each.py_func.__module__ != function.py_func.__module__
    ]


def test_nothing_compiled_calls_what_is_compiled_elsewhere() -> None:
    assert {function.py_func.__qualname__: strangers(function) for function in compiled_functions()} == {
        function.py_func.__qualname__: [] for function in compiled_functions()
    }


def test_a_stranger_is_seen() -> None:
    quick = compiled(doubled)
    quick.py_func.__module__, module = "elsewhere", quick.py_func.__module__  # type: ignore[attr-defined]
    scope: dict[str, Any] = {"quick": quick, "__name__": module}
    exec("def caller(values):\n    return quick(values)", scope)  # noqa: S102 - a function with globals of its own
    try:
        assert strangers(type("Dispatcher", (), {"py_func": scope["caller"]})) == ["elsewhere.doubled"]
    finally:
        doubled.__module__ = module


def test_it_says_the_same_as_the_python() -> None:
    values = np.array([0.1, 0.2])
    quick = compiled(doubled)
    assert isinstance(quick, CPUDispatcher)
    assert plain(quick) is doubled
    assert np.array_equal(quick(values), doubled(values))


def test_where_nothing_can_be_written_it_is_compiled_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    assert compiled(doubled)(np.array([1.5]))[0] == 3.0
