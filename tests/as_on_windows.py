"""Runs the command `inband` after importing all of some rooms, where modules and calls fail as they do on Windows. It is no Windows: paths, files and sockets are not.

What the standard library and platformdirs need on this system is imported first, and goes on having it.
"""

import asyncio
import asyncio.unix_events
import multiprocessing.popen_spawn_posix  # noqa: F401 - what the standard library needs
import os
import pkgutil
import shutil  # noqa: F401
import signal
import sqlite3  # noqa: F401
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
from importlib import import_module
from typing import Any, NoReturn

import platformdirs  # noqa: F401

MISSING = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty", "uvloop"}
CALLS = [
    "chown",
    "fork",
    "openpty",
    "fchown",
    "getegid",
    "geteuid",
    "getgid",
    "getuid",
    "killpg",
    "mkfifo",
    "posix_spawn",
    "setgid",
    "setsid",
    "setuid",
]
FLAGS = ["O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "POSIX_SPAWN_OPEN"]
SIGNALS = ["SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGUSR2"]
NOT_OF_LOOPS = [
    "add_signal_handler",
    "remove_signal_handler",
    "connect_read_pipe",
    "connect_write_pipe",
    "create_unix_connection",
    "create_unix_server",
    "subprocess_exec",
    "subprocess_shell",
]
OF_THE_PROACTOR = ["add_reader", "remove_reader", "add_writer", "remove_writer"]
IN_NO_NAME = set('<>:"|?*')


def missing(*_: Any, **__: Any) -> NoReturn:
    raise NotImplementedError


class Proactor(asyncio.SelectorEventLoop):
    """The loop that Windows gives whoever asks for none: it waits for no sockets of others."""


def rename(source: Any, target: Any, *, real: Any = os.rename) -> None:
    if os.path.lexists(target):
        raise FileExistsError(f"{target} is there already")
    real(source, target)


def no_such_name(event: str, words: tuple[Any, ...]) -> None:
    if event == "open" and isinstance(words[0], str) and IN_NO_NAME & set(words[0]):
        raise OSError(22, "Invalid argument", words[0])


def become_windows() -> None:
    sys.modules.update(dict.fromkeys(MISSING))  # type: ignore[arg-type] # Python's way to say that there is none
    for module, names in ((os, CALLS + FLAGS), (signal, SIGNALS)):
        for name in names:
            delattr(module, name)
    for name in NOT_OF_LOOPS:
        setattr(asyncio.unix_events._UnixSelectorEventLoop, name, missing)
    for name in OF_THE_PROACTOR:
        setattr(Proactor, name, missing)
    asyncio.unix_events._UnixDefaultEventLoopPolicy._loop_factory = Proactor  # type: ignore[attr-defined]
    os.rename = rename  # type: ignore[assignment]
    sys.addaudithook(no_such_name)


if __name__ == "__main__":
    become_windows()
    from app.cli import main

    for name in sys.argv.pop(1).split(","):
        for found in pkgutil.walk_packages(import_module(name).__path__, f"{name}."):
            import_module(found.name)
    main()
