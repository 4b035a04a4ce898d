"""Running a program as someone else than root, for programs that refuse to be root. Linux only; others need nothing of it."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

with contextlib.suppress(ModuleNotFoundError):  # Windows
    import pwd

PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH, CAP_SETPCAP = 1, 2, 8  # bit numbers, capabilities(7)


class RunAsError(Exception):
    """It cannot be run as someone else; the message says why and what to do."""


def is_root() -> bool:
    """Tell if this process may do everything; on Windows none is known to."""
    return hasattr(os, "geteuid") and os.geteuid() == 0


def system_user(name: str) -> "pwd.struct_passwd":
    """The system user ``name``, made when there is none: no home, no shell, no password."""
    useradd = shutil.which("useradd", path=PATH)
    for command in ([useradd] if useradd else []), []:
        with contextlib.suppress(KeyError):
            return pwd.getpwnam(name)
        if command:  # fails when another process is quicker; then the second look finds its user
            options = ["--system", "--user-group", "--no-create-home", "--home-dir", "/nonexistent"]
            subprocess.run(  # noqa: S603 - our own words
                [*command, *options, "--shell", "/usr/sbin/nologin", name], capture_output=True, check=False
            )
    raise RunAsError(
        f"PostgreSQL does not run as root, and the system user {name} that it would run as could not be made. "
        f"Make it (useradd --system {name}) or run Inband as an ordinary user."
    )


def run_as(user: "pwd.struct_passwd", *, reads: Sequence[Path], enters: Sequence[Path]) -> list[str]:
    """The words before a command that make root run it as ``user``; none when this process is not root.

    Where ``user`` may not get to what it ``reads`` or ``enters`` because it lies in a closed home, it gets the right to pass
    (CAP_DAC_READ_SEARCH, or where a container has not got that, CAP_DAC_OVERRIDE); the home stays closed.
    """
    if not is_root():
        return []
    setpriv = shutil.which("setpriv", path=PATH)
    if setpriv is None:
        raise RunAsError(
            "PostgreSQL does not run as root, and setpriv (package util-linux) is not there to run it as somebody else. "
            "Install it or run Inband as an ordinary user."
        )
    words = [setpriv, f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--clear-groups"]
    closed = [path for path in reads if not path.stat().st_mode & 0o004 or not _passable(path.parent)]
    closed += [path for path in enters if not _passable(path)]
    if not closed:
        return words
    for bit, right in ((CAP_DAC_READ_SEARCH, "+dac_read_search"), (CAP_DAC_OVERRIDE, "+dac_override")):
        if _held() >> bit & _held() >> CAP_SETPCAP & 1:
            rights = f"-all,{right}"
            return [*words, "--securebits=+no_setuid_fixup", f"--inh-caps={rights}", f"--ambient-caps={rights}"]
    raise RunAsError(
        f"PostgreSQL does not run as root but as {user.pw_name}, who may not get to {closed[0]}. Choose a --data-dir "
        "(and a place for the program) that others may enter, or run Inband as an ordinary user."
    )


def give(path: Path, user: "pwd.struct_passwd", *, recursive: bool = False) -> None:
    """Root makes ``path`` the user's; others do nothing, for it is theirs already."""
    if is_root():
        for entry in [path, *(path.rglob("*") if recursive else [])]:
            os.chown(entry, user.pw_uid, user.pw_gid, follow_symlinks=False)


def _passable(folder: Path) -> bool:
    return all(entry.stat().st_mode & 0o001 for entry in (folder, *folder.parents))


def _held() -> int:
    """The capabilities that this process has and may hand on, one bit each."""
    lines = Path("/proc/self/status").read_text().splitlines()
    sets = [int(line.split()[1], 16) for line in lines if line.startswith(("CapEff:", "CapBnd:"))]
    return sets[0] & sets[1]
