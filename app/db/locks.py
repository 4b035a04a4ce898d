"""Locks between processes, by files. The system opens them when a process ends, however it ends."""

import contextlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.db.run_as import is_root

with contextlib.suppress(ModuleNotFoundError):  # Windows, where no database is embedded that would need them
    import fcntl


class LockError(Exception):
    """The lock's file cannot be made; the message says why and what to do."""


def open_lock(path: Path) -> int:
    """The file, to be locked; closing it gives the lock back."""
    try:
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise LockError(
            f"{path.parent} cannot be written ({error.strerror}). Run Inband as the user the folder belongs to, "
            "or choose another with --data-dir."
        ) from None
    if is_root():  # sudo in a user's folder must not lock them out
        owner = path.parent.stat()
        os.fchown(lock, owner.st_uid, owner.st_gid)
    return lock


@contextmanager
def exclusive(path: Path, patience: float) -> Iterator[None]:
    """Alone with ``path`` as long as the block runs. Raises TimeoutError after ``patience`` seconds of waiting."""
    lock, deadline = open_lock(path), time.monotonic() + patience
    try:
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise TimeoutError from None
                time.sleep(0.05)
        yield
    finally:
        os.close(lock)
