"""A process of Inband that begins where one which has read the whole program stands.

Reading it takes some seconds, and a run of the tests starts servers by the hundred. What the command does from its first
word on is the same; that it starts from nothing too, tests/cli/test_serve.py sees.
"""

import multiprocessing
import os
import signal
import sys
from multiprocessing.context import ForkServerProcess
from pathlib import Path

from tests.keeper import PR_SET_PDEATHSIG, prctl

multiprocessing.get_context("forkserver").set_forkserver_preload(
    ["app.main", "app.cli.serve", "tests.quick_passwords", "tests.forked"]
)


class Forked(ForkServerProcess):
    """``inband …`` with the words that `subprocess.Popen` has for a process; what it says goes to the end of a file."""

    def __init__(self, arguments: list[str], log: Path) -> None:
        super().__init__()
        self.arguments, self.log = arguments, log
        self.start()

    def run(self) -> None:
        """Run the command in the forked process."""
        from app.cli import main

        if sys.platform == "linux":
            prctl(PR_SET_PDEATHSIG, signal.SIGTERM)  # a worker that is killed takes its servers along
        said = os.open(self.log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        for stream in (1, 2):
            os.dup2(said, stream)
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
