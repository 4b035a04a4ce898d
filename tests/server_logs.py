"""What servers and PostgreSQL have said while a test ran stands in its report when it has failed.

Their logs are named to `follow` once; `tests/conftest.py` takes the hooks from here.
"""

from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

MOST = 8_000  # characters of each log, from its end: what a page of the report can bear
_begins: dict[Path, int] = {}
"""The logs, each with its size when the test that runs now began."""


def follow(log: Path) -> None:
    """From now on this log belongs into the report of a test that has failed."""
    _begins.setdefault(log, 0)


def said() -> Iterator[tuple[Path, str]]:
    """The logs to which something was added since this test began, and the end of that."""
    for log, begin in _begins.items():
        size = _size(log)
        if size != begin:
            with log.open("rb") as file:
                file.seek(max(begin if begin < size else 0, size - MOST))
                yield log, file.read().decode(errors="replace")


def _size(log: Path) -> int:
    return log.stat().st_size if log.exists() else 0


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Remember where the logs end."""
    for log in _begins:
        _begins[log] = _size(log)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Put into the report what was added to the logs."""
    report = yield
    if report.failed:
        report.sections += [(f"log {log}", text) for log, text in said()]
    return report
