"""Hooks of pytest, and the fixtures of all tests: a real PostgreSQL, real server processes, a real browser, people."""

import gc
import os
from typing import Any

import pytest
from playwright.sync_api import expect
from xdist import plugin as xdist_plugin

from tests import chance, forked, keeper, one_connection, quick_passwords  # noqa: F401 - the last two replace what they are about
from tests.browsers import (  # noqa: F401 - fixtures
    browser,
    complaints,
    page,
    playwright,
    screen,
)
from tests.databases import (  # noqa: F401 - fixtures
    database,
    empty_database,
    first_program,
    first_program_template,
    many_readings,
    many_template,
    new_database,
    postgres,
    rolled_back_database,
    session,
    shared_dir,
    whole_cluster,
)
from tests.server_logs import pytest_runtest_makereport, pytest_runtest_setup  # noqa: F401 - hooks of pytest
from tests.servers import (  # noqa: F401 - fixtures
    admin,
    common_server,
    common_shop,
    engineer,
    operator,
    run_server,
    server,
    shop,
    viewer,
)

for name in [name for name in os.environ if name.startswith(("INBAND_", "PG")) and name != "INBAND_TEST_CITUS"]:
    del os.environ[name]  # no test may meet a real installation
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # hundreds of servers start; each would compile the whole house anew

expect.set_options(timeout=60_000)  # ms; what is expected comes at once where the computer has nothing else to do


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One more than usual: a third of the time tests wait, for a browser or for a server that starts."""
    return int(xdist_plugin.pytest_xdist_auto_num_workers(config)) + 1


def pytest_configure(config: pytest.Config) -> None:
    chance.load(long=config.getoption("--long"))
    gc.disable()  # until all tests are collected
    if config.getoption("--one-connection"):
        os.environ |= {"INBAND_POOL_SIZE": "1", "INBAND_POOL_OVERFLOW": "0"}
    if hasattr(config, "workerinput"):
        forked.share(config.workerinput["fork_server"])


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """One fork server reads the program for all workers, while they collect."""
    node.workerinput["fork_server"] = forked.begin()


def pytest_collection_finish() -> None:
    """Thousands of tests were collected to stay; no round of garbage collection need look at them again, nor often at others."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # by default, a tenth of the processor of a whole run went into it
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say how to have the same order and the same chance again."""
    seed = config.getoption("randomly_seed", None)
    if seed is not None and (terminalreporter.stats.get("failed") or terminalreporter.stats.get("error")):
        long = "--long " if config.getoption("--long") else ""
        terminalreporter.write_line(f"to repeat it: {long}--randomly-seed={seed}")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`make test` leaves out what is slow by nature; `make test-long` runs that, and all that is tried at random."""
    long, one = config.getoption("--long"), config.getoption("--one-connection")
    left_out = [each for each in items if not _runs(each, long=long, one=one)]
    items[:] = [each for each in items if _runs(each, long=long, one=one)]
    config.hook.pytest_deselected(items=left_out)


def _runs(item: pytest.Item, *, long: bool, one: bool) -> bool:
    if one and item.get_closest_marker("several_connections"):
        return False
    if item.get_closest_marker("long"):
        return long
    return not long or item.get_closest_marker("hypothesis") is not None
