"""The examples in the docstrings of the core, and of what writes numbers and addresses, run and answer as printed."""

import doctest
import importlib
import pkgutil

import pytest

import app.core

MODULES = sorted(module.name for module in pkgutil.walk_packages(app.core.__path__, "app.core."))
FILES = [f"app.files.formats.{name}" for name in ("cell_values", "file_times", "periods", "repeats")]


@pytest.mark.parametrize(
    "name",
    [
        "app.core",
        *MODULES,
        "app.db.binaries",
        *FILES,
        "app.language.numbers",
        "app.views.licences.libraries",
        "app.web.paging",
    ],
)
def test_examples_answer_as_printed(name: str) -> None:
    failed, _tried = doctest.testmod(importlib.import_module(name))
    assert failed == 0


def test_there_are_examples_to_run() -> None:
    examples = sum(
        len(test.examples)
        for name in MODULES
        for test in doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name))
    )
    assert examples >= 40
