"""What a run of the tests starts ends with it, however it ends. Here runs of small files are ended in every way."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

import pytest

from app import HOUSE
from tests import keeper

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="there is no keeper")
long = pytest.mark.long

VARIABLE = "TESTS_RUN_TO_BE_ENDED"
IMPATIENT = """
from signal import SIGKILL, SIGQUIT, SIGTERM
from tests import keeper

keeper.IN_ORDER, keeper.BY_ITSELF = 3.0, 0.5
keeper.WAYS = ((SIGTERM, 0.5), (SIGQUIT, 0.5), (SIGKILL, 30.0))
"""
CASES = """
import os, signal, subprocess, sys, time
from pathlib import Path

import pytest

HERE = Path(__file__).parent
DEAF = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(flush=True); time.sleep(600)"


def begin(name):
    subprocess.run(["setsid", "--fork", "sleep", "600"], check=True)  # its parent has ended
    stopped = subprocess.Popen(["sleep", "600"])
    stopped.send_signal(signal.SIGSTOP)
    deaf = subprocess.Popen([sys.executable, "-S", "-c", DEAF], stdout=subprocess.PIPE, start_new_session=True)
    deaf.stdout.readline()
    (HERE / f"new-{name}").write_text(str(os.getpid()))
    (HERE / f"new-{name}").rename(HERE / f"began-{name}")
    return stopped, deaf


def test_that_leaves_nothing():
    short = subprocess.Popen(["sleep", "600"])
    short.kill()
    short.wait()


def test_that_leaves_something():
    for each in begin("left"):
        each.returncode = 0  # whoever forgets a process is warned by Python, otherwise


@pytest.mark.parametrize("number", range(4))
def test_that_goes_on(number):
    kept = begin(number)
    time.sleep(600)
"""


def outside() -> dict[str, str]:
    """The environment of somebody who is in no run of the tests."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", keeper.MARK))}


def until(condition: Callable[[], bool], what: Callable[[], str], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            pytest.fail(f"it did not come to that: {what()}")
        time.sleep(0.05)


class Run:
    """A run of `CASES`. All its processes have a variable by which they are known, wherever they have gone."""

    def __init__(self, folder: Path, words: str, *more: str) -> None:
        self.folder, self.mark = folder, uuid4().hex
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", keeper.MARK))
        }
        environment |= {VARIABLE: self.mark, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": f"{folder}:{HOUSE}"}
        command = [
            "-c",
            "pytest.ini",
            "-p",
            "impatient",
            "-p",
            "tests.keeper",
            "-p",
            "xdist.plugin",
            "-p",
            "no:cacheprovider",
        ]
        command += ["--max-worker-restart=0", "-k", words, *more]
        with (folder / "log").open("wb") as log:
            self.keeper = subprocess.Popen(
                [sys.executable, "-m", "pytest", *command], cwd=folder, env=environment, stdout=log, stderr=log
            )

    @property
    def left(self) -> list[int]:
        """All its processes that have not ended."""
        sought = f"{VARIABLE}={self.mark}\0".encode()
        return [pid for pid, state, _ in keeper._processes() if state != "Z" and sought in keeper._read(pid, "environ")]

    @property
    def controller(self) -> int:
        (found,) = (pid for pid, _, parent in keeper._processes() if parent == self.keeper.pid and self._is_pytest(pid))
        return found

    def _is_pytest(self, pid: int) -> bool:
        return b"\0-m\0pytest\0" in keeper._read(pid, "cmdline")

    def workers(self, count: int = 2) -> list[int]:
        """So many workers, each of which has begun its test."""
        self.until(lambda: len(list(self.folder.glob("began-*"))) >= count, "the tests have begun")
        return [int(each.read_text()) for each in self.folder.glob("began-*")]

    def until(self, condition: Callable[[], bool], what: str) -> None:
        until(condition, lambda: f"{what}\n{self.said}")

    @property
    def said(self) -> str:
        return (self.folder / "log").read_text()

    def ended(self) -> int:
        """The exit status; by then, there is nothing left."""
        status = self.keeper.wait(60)
        assert self.left == [], self.said
        assert self.memory == []
        return status

    @property
    def memory(self) -> list[Path]:
        """Its folder in memory, until that is removed."""
        return list(keeper.MEMORY.glob(f"inband-test-{self.keeper.pid}-*"))


Begin = Callable[..., Run]


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Begin]:
    runs = []
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "impatient.py").write_text(IMPATIENT)
    (tmp_path / "test_cases.py").write_text(CASES)

    def begin(words: str, *more: str) -> Run:
        runs.append(Run(tmp_path, words, *more))
        return runs[-1]

    yield begin
    for each in runs:
        for pid in each.left:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        each.keeper.wait()


def test_a_run_that_leaves_nothing_passes(run: Begin) -> None:
    ended = run("leaves_nothing", "-n", "0")
    assert ended.ended() == 0, ended.said
    assert "left behind" not in ended.said


def test_a_run_that_leaves_something_behind_fails_and_says_what(run: Begin) -> None:
    ended = run("leaves_something", "-n", "0")
    assert ended.ended() == 1, ended.said
    assert "1 passed" in ended.said
    left = [line.split()[9] for line in ended.said.splitlines() if line.startswith("left behind by the tests")]
    assert sorted(left) == sorted(["sleep", "sleep", sys.executable]), ended.said


def test_sigterm_ends_a_run_and_all_that_it_has_started(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    going.workers()
    going.keeper.terminate()
    assert going.ended() != 0


@long
@pytest.mark.parametrize("workers", [0, 2])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_so_does_every_other_request_to_end(run: Begin, workers: int, number: signal.Signals) -> None:
    going = run("goes_on", "-n", str(workers))
    going.workers(max(workers, 1))
    going.keeper.send_signal(number)
    assert going.ended() != 0


@long
def test_a_second_request_is_not_waited_for(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    going.workers()
    os.kill(going.controller, signal.SIGSTOP)
    for _again in range(2):
        going.keeper.send_signal(signal.SIGINT)
        time.sleep(0.2)
    assert going.ended() == 128 + signal.SIGKILL


def test_the_end_of_a_worker_is_the_end_of_the_run(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    first, _second = going.workers()
    os.kill(first, signal.SIGKILL)
    assert going.ended() != 0
    assert "crashed" in going.said


@long
def test_a_killed_controller_leaves_nothing(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    going.workers()
    os.kill(going.controller, signal.SIGKILL)
    assert going.ended() == 128 + signal.SIGKILL


@long
def test_a_killed_keeper_leaves_nothing(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    going.workers()
    going.keeper.kill()
    going.until(lambda: not going.left and not going.memory, "nothing is left")


@long
def test_what_is_left_where_both_are_killed_is_ended_by_the_next_run(run: Begin) -> None:
    going = run("goes_on", "-n", "2")
    going.workers()
    controller = going.controller
    going.keeper.send_signal(signal.SIGSTOP)  # so that neither sees the other's end
    os.kill(controller, signal.SIGKILL)
    going.keeper.kill()
    assert run("leaves_nothing", "-n", "0").ended() == 0
    going.until(lambda: not going.left and not going.memory, "nothing is left")


@long
def test_of_the_real_tests_no_database_no_server_and_no_browser_stays(tmp_path: Path) -> None:
    command = [
        "-q",
        "-n",
        "2",
        "-p",
        "no:cacheprovider",
        "tests/plants/test_plants.py",
        "-k",
        "TestAddresses or TestOverview",
    ]
    said, seen = tmp_path / "log", dict[int, tuple[int | None, bytes]]()
    with said.open("wb") as log:
        run = subprocess.Popen(
            [sys.executable, "-m", "pytest", *command], cwd=HOUSE, env=outside(), stdout=log, stderr=log
        )

    def all_there() -> bool:
        assert run.poll() is None, said.read_text()
        seen.update({pid: (keeper._start(pid), keeper._read(pid, "cmdline")) for pid in keeper.descendants(run.pid)})
        return all(
            any(word in line for _, line in seen.values())
            for word in (b"postgres\0-D", b"multiprocessing.forkserver", b"chrom")
        )

    try:
        until(all_there, said.read_text, 300)
        run.terminate()
        assert run.wait(60) != 0
    finally:
        run.kill()
        run.wait()
    assert [line for pid, (start, line) in seen.items() if start is not None and keeper._start(pid) == start] == []
