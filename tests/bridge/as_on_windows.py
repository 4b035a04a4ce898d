"""Runs the command `inband` where modules and calls fail as they do on Windows. It is no Windows: paths, files and sockets are not.

What the standard library needs for itself on this system is imported first, and goes on having it.
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
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, NoReturn

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
    "uname",
]
FLAGS = ["O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "POSIX_SPAWN_OPEN"]
SIGNALS = ["SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGUSR2"]
OF_LOOPS = [
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


class Missing:
    """Finds nothing of what Windows does not have."""

    @staticmethod
    def find_spec(
        name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name.partition(".")[0] in MISSING:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return None


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
    for name in MISSING:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Missing)
    for module, names in ((os, CALLS + FLAGS), (signal, SIGNALS)):
        for name in names:
            delattr(module, name)
    for name in OF_LOOPS:
        setattr(asyncio.unix_events._UnixSelectorEventLoop, name, missing)
    for name in OF_THE_PROACTOR:
        setattr(Proactor, name, missing)
    asyncio.unix_events._UnixDefaultEventLoopPolicy._loop_factory = Proactor  # type: ignore[attr-defined]
    os.rename = rename
    sys.addaudithook(no_such_name)


if __name__ == "__main__":
    become_windows()
    import app.bridge
    import app.simulators.controls
    from app.cli import main

    for room in (app.bridge, app.simulators.controls):
        for found in pkgutil.walk_packages(room.__path__, f"{room.__name__}."):
            import_module(found.name)
    main()
