"""Files in folders into which others write too: regular files only, and never through a link.

A link would have the bridge read, and quote, or overwrite what only its own rights lead to.
"""

import os
import stat
from pathlib import Path

_FLAGS = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


class NotPlain(OSError):
    """A link, a pipe, or something else that is no regular file."""


def is_plain(path: Path) -> bool:
    """Tell if a regular file is at a path itself. Raises `OSError` where there is nothing."""
    return stat.S_ISREG(path.lstat().st_mode)


def read_plain(path: Path) -> tuple[bytes, os.stat_result]:
    """The content of a regular file, and what was known of it when it was opened. Raises `OSError`, `NotPlain` too."""
    before = path.lstat()
    if not stat.S_ISREG(before.st_mode):
        raise NotPlain(0, "it is a link, or no regular file: put the file itself there")
    with os.fdopen(os.open(path, _FLAGS), "rb") as file:
        about = os.fstat(file.fileno())
        if not os.path.samestat(before, about):
            raise NotPlain(0, "it was exchanged while it was opened")
        return file.read(), about


def write_new(path: Path, content: bytes) -> None:
    """Make a file that holds this; one that is there already, or a link, is taken away first. Raises `OSError`."""
    path.unlink(missing_ok=True)
    with path.open("xb") as file:
        file.write(content)
