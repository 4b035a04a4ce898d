"""The lock beside a store, which a bridge holds while it runs, and errors of a store in words."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path


class StoreError(Exception):
    """The store cannot be written: disk full, no rights, damaged. Nothing was acknowledged to a control."""


def in_words(error: BaseException, file: Path, verb: str = "written") -> BaseException:
    """An error of the database or the disk in words; any other as it is."""
    if not isinstance(error, sqlite3.Error | OSError):
        return error
    words = str(error)
    if "full" in words:
        return StoreError(f"The disk of {file} is full: free space. Nothing is fetched from the controls until then.")
    what = "Its folder has to be there, and the bridge needs the right to write in it."
    if "not a database" in words or "malformed" in words:
        what = "It is damaged, or another program's: move it away, or name another file in [store]."
    return StoreError(
        f"The store {file} cannot be {verb}: {words}. {what} Nothing is fetched from the controls until then."
    )


@contextmanager
def alone_with(file: Path) -> Iterator[None]:
    """Keep every other program from the controls of a store while it lasts; a killed one keeps nobody. Raises `StoreError`."""
    lock_file = lock_of(file)
    with closing(sqlite3.connect(lock_file, isolation_level=None, check_same_thread=False, timeout=0)) as lock:
        try:
            lock.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            if "locked" not in str(error):
                raise in_words(error, lock_file, "opened") from error
            raise StoreError(
                f"Another program works with the controls of {file}: a bridge, or a touch test. End it first (as a"
                " service: systemctl stop); one store has one bridge."
            ) from error
        yield


def lock_of(file: Path) -> Path:
    """The file beside a store that a bridge keeps locked while it runs."""
    return file.with_name(f"{file.name}.running")
