"""Compiled loops: the same as the Python they are made from, renewed with it, wherever the house is installed."""

import ast
import importlib
import inspect
import os
import pkgutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.caching import CacheImpl
from numba.core.registry import CPUDispatcher

import app.core
from app import HOUSE
from app.core.compile_now import compile_each
from app.core.compiled import compiled, functions_of, plain
from app.core.control_plan import Plan
from app.core.decision.loops import follow, follow_each
from app.core.measured_gain import _missed, measured_effect
from app.core.replay import Policy, ReplayedCharacteristic, figures_of, sampled, without_events
from app.core.spc.cusum import _sums, cusum
from app.core.spc.ewma import _smoothed, ewma
from app.core.spc.mixture import _rounds, fitted_two_normals
from app.core.spc.rules import signals_of, signals_of_cusum
from app.core.spc.scan import beyond_runs, equal_runs, painted
from app.core.spc.shewhart import individuals, individuals_baseline
from tests.core.conftest import SEAT


def doubled(values: Any) -> Any:
    return values * 2.0


def compiled_functions() -> list[Any]:
    found = {}
    for module in pkgutil.walk_packages(app.core.__path__, "app.core."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, CPUDispatcher):
                found[value.py_func.__module__, value.py_func.__qualname__] = value
    return list(found.values())


def foreign(function: Any) -> list[str]:
    """Names that compiled code takes from a file of ours whose change would not renew what is kept of it."""
    functions = functions_of(plain(function))
    files = {each.__module__ for each in functions}
    taken = []
    for each in functions:
        tree = ast.parse(inspect.getsource(sys.modules[each.__module__]))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        origin = {alias.name: node.module or "" for node in imports for alias in node.names}
        names = [(name, origin.get(name, "")) for name in each.__code__.co_names]
        taken += [name for name, module in names if module.startswith("app.") and module not in files]
    return taken


def test_a_change_of_any_function_that_is_called_renews_what_is_kept(tmp_path: Path) -> None:
    package = tmp_path / "app_of_two"
    package.mkdir()
    (package / "loops.py").write_text(
        "from app.core.compiled import compiled\nfrom app_of_two.step import step\n"
        "@compiled\ndef loop(value):\n    return step(value)\nprint(loop(1.0), sum(loop.stats.cache_hits.values()))\n"
    )

    def answer(step: str) -> str:
        (package / "step.py").write_text(f"def step(value):\n    return value {step}\n")
        return subprocess.run(
            [sys.executable, "-c", "import app_of_two.loops"],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{HOUSE}", "PYTHONDONTWRITEBYTECODE": "1"},
            check=True,
            capture_output=True,
            text=True,
        ).stdout.strip()

    assert [answer("+ 1"), answer("+ 1"), answer("+ 2")] == ["2.0 0", "2.0 1", "3.0 0"]


def test_constants_come_from_files_that_renew_what_is_kept() -> None:
    assert {function.py_func.__qualname__: foreign(function) for function in compiled_functions()} == {
        function.py_func.__qualname__: [] for function in compiled_functions()
    }


def test_it_says_the_same_as_the_python() -> None:
    values = np.array([0.1, 0.2])
    quick = compiled(doubled)
    assert isinstance(quick, CPUDispatcher)
    assert plain(quick) is doubled
    assert np.array_equal(quick(values), doubled(values))


def test_where_nothing_can_be_written_it_is_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    assert compiled(doubled)(np.array([1.5]))[0] == 3.0


def test_no_page_waits_for_the_compiler() -> None:
    """The server compiles at its start with the types that pages call with later: these compile nothing again."""
    for _ in compile_each():
        pass
    loops: list[Any] = [beyond_runs, equal_runs, painted, _smoothed, _sums, _rounds, _missed, follow, follow_each]
    before = [list(loop.signatures) for loop in loops]
    assert all(before)
    history = np.random.default_rng(5).normal(0.0, 0.001, 3_000)
    baseline = individuals_baseline(history)
    for chart in (individuals(baseline, history), ewma(baseline, history)):
        signals_of(chart).sides(0)
    signals_of_cusum(cusum(baseline, history)).sides(0)
    fitted_two_normals(np.vstack((history, history)))
    measured_effect(history, (np.arange(3_000) // 9 % 5 * 0.002).astype(np.float64), -1.0, np.arange(3_000) % 100 == 0)
    policy = Policy((ReplayedCharacteristic(SEAT, 1.0),))
    figures_of(without_events(history), [policy] * 2)
    sampled(without_events(history), policy, [Plan(every=5, after_alarm=2)])
    assert [list(loop.signatures) for loop in loops] == before
