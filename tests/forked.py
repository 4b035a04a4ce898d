"""A process of Inband that begins where one which has read the whole program stands.

Reading it takes some seconds, and a run of the tests starts servers and commands by the hundred. What the command does from
its first word on is the same; that it starts from nothing too, tests/cli/test_serve.py sees.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from multiprocessing import forkserver, resource_tracker
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

from tests.keeper import PR_SET_PDEATHSIG, prctl

multiprocessing.get_context("forkserver").set_forkserver_preload(["tests.preloaded", "tests.forked"])
SERVER: Any = forkserver._forkserver  # there is no public way to share one
SHARED = ("_forkserver_address", "_forkserver_authkey")
"""What another process needs to know of a fork server; the key is there from Python 3.14 on."""


def begin() -> dict[str, Any]:
    """Let the fork server read the program from now on; the answer is for `share`, in another process of the same run."""
    SERVER.ensure_running()
    return {name: getattr(SERVER, name) for name in SHARED if hasattr(SERVER, name)}


def share(begun: dict[str, Any]) -> None:
    """Use the fork server of the process that has begun it, and that ends it."""
    vars(SERVER).update(begun, _forkserver_alive_fd=os.open(os.devnull, os.O_RDONLY))
    SERVER.ensure_running = resource_tracker.ensure_running


def inband(
    *words: object, typed: str = "", limit: float = 120, expect: int | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """A command as somebody types it: its exit status and what it said. Another status than ``expect`` fails the test.

    It has this process's folder and environment and ``environment``, and a data folder of its own if that names none.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out, err, keyboard = folder / "out", folder / "err", folder / "keyboard"
        keyboard.write_text(typed, encoding="utf-8")
        variables = dict(os.environ) | {"COLUMNS": "200", "INBAND_DATA_DIR": str(folder / "data")} | environment
        process = Forked([str(word) for word in words], err, out=out, keyboard=keyboard, environment=variables)
        try:
            status = process.wait(limit)
        except TimeoutError:
            process.kill()
            process.wait()
            raise
        finally:
            said = [each.read_bytes().decode() if each.exists() else "" for each in (out, err)]
        assert expect in {None, status}, said[1]
        return subprocess.CompletedProcess(process.arguments, status, *said)


class Forked(ForkServerProcess):
    """``inband …`` with the words that `subprocess.Popen` has for a process; what it says goes to the end of a file.

    It has the environment of the process that starts it, unless another one is given.
    """

    def __init__(
        self,
        arguments: list[str],
        log: Path,
        *,
        out: Path | None = None,
        keyboard: Path | None = None,
        environment: dict[str, str] | None = None,
    ) -> None:
        super().__init__()
        self.arguments, self.environment, self.folder = arguments, environment or dict(os.environ), Path.cwd()
        self.files = (keyboard or Path(os.devnull), out or log, log)
        self.start()

    def run(self) -> None:
        """Run the command in the forked process."""
        from app.cli import main

        if sys.platform == "linux":
            prctl(PR_SET_PDEATHSIG, signal.SIGTERM)  # a worker that is killed takes its servers along
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)
        time.tzset()
        for stream, file in enumerate(self.files):
            os.dup2(os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT if stream else os.O_RDONLY), stream)
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - multiprocessing has closed it
        sys.argv = ["inband", *self.arguments]
        main()

    @property
    def returncode(self) -> int | None:
        """Its exit status; negative if a signal ended it; None as long as it runs."""
        return self.exitcode

    def poll(self) -> int | None:
        """Its exit status, if it has ended."""
        return self.exitcode

    def wait(self, timeout: float | None = None) -> int:
        """Its exit status, once it has ended. Raises `TimeoutError`."""
        self.join(timeout)
        if self.exitcode is None:
            raise TimeoutError
        return self.exitcode

    def send_signal(self, number: int) -> None:
        """As `os.kill`."""
        assert self.pid is not None
        os.kill(self.pid, number)
