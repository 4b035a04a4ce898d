"""Whatever a run of the tests starts ends with the run, however the run ends.

PostgreSQL clusters, servers, browsers and brokers are started by the hundred, some in sessions of their own, some stopped on
purpose. The process that somebody starts as ``pytest`` therefore becomes the keeper of the run, and the run its child: when
the run has ended, by itself, by Ctrl-C, SIGTERM or SIGKILL, the keeper ends what is left. The kernel gives it every orphan
of the run (prctl(2), PR_SET_CHILD_SUBREAPER), so none escapes. If the keeper itself is killed, the run hears of it
(PR_SET_PDEATHSIG) and does the same. If both are killed at once, the next run ends what they left.

The keeper also lends the run a folder in memory, for databases that are made and dropped by the thousand, and removes it.

A run that ends by itself and leaves a process behind has failed, and the keeper says which.

This is a plugin (``-p tests.keeper`` in pyproject.toml), because that is read before pytest captures anything. Linux only;
elsewhere tests run without a keeper.
"""

import contextlib
import ctypes
import os
import re
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest

import app  # noqa: F401 - what it sets has to be set before a plugin imports NumPy

MARK = "TESTS_KEPT_BY"
"""Variable that everything started by a run inherits: process number and start of its keeper."""
PROC = Path("/proc")
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
IN_ORDER = 6.0  # s that an interrupted run may take to end by itself
# Seconds in which what a finished run has started ends by itself; on a busy computer a fork server takes some.
BY_ITSELF = 60.0
# PostgreSQL inherits no environment. Its cluster lies in a folder that is locked as long as the run lasts: pytest's, or one
# of `tests.databases.short_folder`.
CLUSTER = re.compile(rb"postgres\0-D\0(/[^\0]*/(?:pytest-of-[^/\0]+/pytest-\d+|inband-test-[^/\0]+))/")
MEMORY, ROOM = Path("/dev/shm"), 4 * 2**30  # bytes that are free there and in memory, or the run uses the disk  # noqa: S108
# PostgreSQL waits for its clients at SIGTERM and ends at once at SIGQUIT.
WAYS = ((signal.SIGTERM, 3.0), (signal.SIGQUIT, 2.0), (signal.SIGKILL, 3.0))


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `make test-long`; keep the run from here on, before pytest captures anything."""
    parser.addoption("--long", action="store_true", help="run what is slow by nature, and chance with fresh seeds")
    parser.addoption("--one-connection", action="store_true", help="servers have one connection for all their pages")
    if sys.platform == "linux" and MARK not in os.environ:
        keep()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(error: object | None) -> None:
    """End the run with a worker that has crashed, in the middle of what the other workers do."""
    if error:
        for pid in _workers(os.getpid()):
            _send(pid, signal.SIGINT)


def keep() -> None:
    """Return in a child of this process; this process goes on as its keeper and never returns."""
    end(abandoned)
    _forget()
    os.environ[MARK] = f"{os.getpid()} {_start(os.getpid())}"
    _borrow()
    heard = {signal.SIGCHLD, signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, heard)
    prctl(PR_SET_CHILD_SUBREAPER, 1)
    keeper, run = os.getpid(), os.fork()
    if run:
        os._exit(_watched(run, heard))
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it for what runs in the background
    signal.signal(signal.SIGTERM, _keeper_was_killed)
    prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    if os.getppid() != keeper:  # killed before it could be heard of
        os._exit(128 + signal.SIGTERM)


def mark() -> dict[str, str]:
    """Variable for a process that is started with an environment of its own: by it the next run knows what this one has left."""
    return {name: value for name, value in os.environ.items() if name == MARK}


def in_memory() -> Path | None:
    """A folder in memory that goes with the run; None where there is too little of it."""
    folder = _folder()
    return folder if folder.exists() else None


def _folder() -> Path:
    return MEMORY / f"inband-test-{os.environ.get(MARK, '').replace(' ', '-')}"


def _borrow() -> None:
    with contextlib.suppress(OSError, KeyError):  # another system, or somebody else's folder
        memory = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        if min(shutil.disk_usage(MEMORY).free, int(memory["MemAvailable"].split()[0]) * 1024) >= ROOM:
            _folder().mkdir(mode=0o700)
            (_folder() / ".lock").write_text(str(os.getpid()))


def _forget() -> None:
    """Remove the folders in memory of runs whose keepers have ended."""
    for folder in MEMORY.glob("inband-test-*-*"):
        pid, start = folder.name.split("-")[2:]
        if pid.isdigit() and str(_start(int(pid))) != start:
            shutil.rmtree(folder, ignore_errors=True)


def prctl(option: int, value: int) -> None:
    """prctl(2)."""
    if ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0):
        raise OSError(ctypes.get_errno(), f"prctl {option}")


def _watched(run: int, heard: set[signal.Signals]) -> int:
    """The exit status of the run, once it and all that it has started have ended."""
    deadline, ended = None, None
    while ended is None:
        info = signal.sigtimedwait(heard, 1 if deadline is None else max(0, deadline - time.monotonic()))
        if info is not None and info.si_signo != signal.SIGCHLD:
            if deadline is not None:
                deadline = 0.0  # asked again: at once
            elif info.si_signo != signal.SIGINT or info.si_code <= 0:  # the terminal's Ctrl-C reaches the run as well
                for pid in (run, *_workers(run)):
                    _send(pid, signal.SIGINT)
            deadline = time.monotonic() + IN_ORDER if deadline is None else deadline
        if deadline is not None and time.monotonic() >= deadline:
            _send(run, signal.SIGKILL)
        ended = _reaped().get(run)
    status = os.waitstatus_to_exitcode(ended)
    if deadline is None and status == 0:
        status = _finished()
    end(descendants)
    shutil.rmtree(_folder(), ignore_errors=True)
    return status if status >= 0 else 128 - status


def _finished() -> int:
    """The exit status of a run that ended by itself and has not failed so far: it has if it left something behind."""
    deadline = time.monotonic() + BY_ITSELF
    while (left := descendants()) and time.monotonic() < deadline:
        time.sleep(0.05)
        _reaped()
    for pid in left:
        sys.stderr.write(f"left behind by the tests, and ended now: {pid} {_command(pid)}\n")
    return int(bool(left))


def _keeper_was_killed(number: int, frame: FrameType | None) -> None:
    """End what the keeper would have ended: what this run has started, and the orphans that had come to the keeper."""
    prctl(PR_SET_CHILD_SUBREAPER, 1)
    end(lambda: [*descendants(), *abandoned()])
    _forget()
    os._exit(128 + number)


def end(find: Callable[[], list[int]]) -> None:
    """End the processes that `find` gives, also stopped ones and those that ignore a request."""
    for way, seconds in WAYS:
        for pid in find():
            _send(pid, way)
            _send(pid, signal.SIGCONT)
        deadline = time.monotonic() + seconds
        while find() and time.monotonic() < deadline:
            time.sleep(0.02)
            _reaped()
        if not find():
            return


def descendants(process: int | None = None) -> list[int]:
    """All that a process, this one, has started and that has not ended, and all that those have started."""
    parents = {pid: parent for pid, state, parent in _processes() if state not in {"Z", "X"}}
    found = [os.getpid() if process is None else process]
    for pid in found:
        found += [child for child, parent in parents.items() if parent == pid]
    return found[1:]


def _workers(run: int) -> list[int]:
    """The processes that Ctrl-C in a terminal would reach as well: those with no session of their own."""
    workers = []
    for child in (child for child, _, parent in _processes() if parent == run):
        with contextlib.suppress(ProcessLookupError):
            if os.getpgid(child) == os.getpgid(run):
                workers.append(child)
    return workers


def _send(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(pid, number)


def abandoned() -> list[int]:
    """What runs left behind that were killed together with their keepers."""
    return [pid for pid, state, _ in _processes() if state != "Z" and _is_abandoned(pid)]


def _is_abandoned(pid: int) -> bool:
    if _is_elsewhere(pid):
        return False
    mark = re.search(rb"(?:^|\0)%b=(\d+) (\d+)\0" % MARK.encode(), _read(pid, "environ"))
    if mark is not None:
        return _start(int(mark[1])) != int(mark[2])
    cluster = CLUSTER.search(_read(pid, "cmdline"))
    if cluster is None:
        return False
    try:
        return _start(int((Path(os.fsdecode(cluster[1])) / ".lock").read_text())) is None
    except (OSError, ValueError):  # somebody else's
        return False


def _is_elsewhere(pid: int) -> bool:
    """Tell if it lives in a container, where numbers and paths mean other things."""
    try:
        return (PROC / str(pid) / "ns/pid").readlink() != (PROC / "self/ns/pid").readlink()
    except OSError:
        return False


def _reaped() -> dict[int, int]:
    """Children that have ended, with their status."""
    ended = {}
    with contextlib.suppress(ChildProcessError):
        while (found := os.waitpid(-1, os.WNOHANG))[0]:
            ended[found[0]] = found[1]
    return ended


def _processes() -> Iterator[tuple[int, str, int]]:
    """Number, state and parent of every process."""
    for folder in PROC.iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                state, parent = _stat(int(folder.name))[:2]
                yield int(folder.name), state, int(parent)


def _stat(pid: int) -> list[str]:
    """Fields of /proc/PID/stat from the third on, the state; the second, the name, may hold blanks."""
    return (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()


def _start(pid: int) -> int | None:
    """When the process began, in ticks since the system did; None if there is none."""
    try:
        fields = _stat(pid)
    except OSError:
        return None
    return None if fields[0] == "Z" else int(fields[19])


def _read(pid: int, file: str) -> bytes:
    """One of the files of a process; empty where it has ended, or is not for this user to see."""
    try:
        return (PROC / str(pid) / file).read_bytes()
    except OSError:
        return b""


def _command(pid: int) -> str:
    return _read(pid, "cmdline").replace(b"\0", b" ").decode(errors="replace")[:200]
