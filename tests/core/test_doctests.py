"""The examples in the docstrings of `app/` run and answer as printed."""

import doctest
import importlib

import pytest

from app import HOUSE

APP = HOUSE / "app"
PATHS = [path for path in sorted(APP.rglob("*.py")) if "client" not in path.parts and ">>> " in path.read_text("utf-8")]
MODULES = [".".join(path.relative_to(HOUSE).with_suffix("").parts).removesuffix(".__init__") for path in PATHS]


@pytest.mark.parametrize("name", MODULES)
def test_examples_answer_as_printed(name: str) -> None:
    failed, _tried = doctest.testmod(importlib.import_module(name))
    assert failed == 0


def test_there_are_examples_to_run() -> None:
    examples = sum(
        len(test.examples)
        for name in MODULES
        if name.startswith("app.core")
        for test in doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name))
    )
    assert examples >= 40
