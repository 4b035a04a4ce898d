"""Files of others, read in a process of their own with limits on time, memory and bytes written.

A small file can ask for hours, or for a hundred gigabytes. The process ends at a limit, and with the server; the server goes on,
holds no transaction meanwhile, and says which limit it was. What such a process needs is imported in a tenth of a second:
the formats, not the program. Commands read in their own process, with no limits but those of the formats.
"""

import errno
import logging
import os
import pickle  # the process at the other end is our own program; nothing of a file is unpickled
import shutil
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Any, TypeVar

import app
from app.errors import InbandError, TooManyRequests
from app.files.formats.delimited import Unusable
from app.language.i18n import _, current_language, speaking
from app.memory import BEHIND

log = logging.getLogger(__name__)
Result = TypeVar("Result")

MEGABYTE = 1_000_000
MOST_AT_ONCE = 2  # of one server process: readings go first
WAIT = 30.0  # s for one of them to end
PATIENCE = 3  # times the limit of processor time may pass by the clock
YESTERDAY = 24 * 3600.0  # s
PREFIX = "inband-file-"
PROGRAM = f"{BEHIND}; from app.files.apart import begin; begin()"
OUT_OF_MEMORY, OUT_OF_ROOM, DISK_FULL, OUT_OF_TIME = 10, 11, 12, 13  # as it ends
ENDED_BY_TIME = {OUT_OF_TIME, *(-getattr(signal, name) for name in ("SIGXCPU", "SIGKILL") if hasattr(signal, name))}


@dataclass(frozen=True)
class Limits:
    """Limits of one reading. seconds: of a processor. memory, written: bytes."""

    seconds: int = 60
    memory: int = 1_000 * MEGABYTE
    written: int = 500 * MEGABYTE


LIMITS = Limits()
_free = threading.BoundedSemaphore(MOST_AT_ONCE)
_room: int | None = None  # bytes that this process may still write; None: no limit


def apart(work: Callable[..., Result], *given: Any, limits: Limits | None = None, remedy: str | None = None) -> Result:
    """The result of a function, called in a process of its own.

    work: of a module that imports little. remedy: what to do at a limit, if not what a table is helped by. Raises what it raises of ours, `Unusable` at a limit, `TooManyRequests` while others
    are read, and `OSError` for a full disk.
    """
    limits = limits or LIMITS
    if not _free.acquire(timeout=WAIT):
        raise TooManyRequests(
            _("Other files are being read at the moment."), _("Send it again in a moment."), retry_after=10
        )
    try:
        with TemporaryDirectory(prefix=PREFIX) as name:
            folder = Path(name)
            (folder / "task").write_bytes(pickle.dumps((limits, current_language(), work, given)))
            return _result(folder / "result", _run(folder, limits), limits, work, remedy)  # type: ignore[no-any-return]
    finally:
        _free.release()


def _run(folder: Path, limits: Limits) -> int:
    environment = {
        name: os.environ[name] for name in ("PATH", "SYSTEMROOT") if name in os.environ
    }  # Windows needs that one
    environment["PYTHONPATH"] = str(Path(app.__path__[0]).parent)
    command = [sys.executable, "-W", "ignore", "-c", PROGRAM, str(folder), str(os.getpid())]
    try:
        return subprocess.run(  # noqa: S603 - our own words
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=limits.seconds * PATIENCE,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        return OUT_OF_TIME


def _result(path: Path, code: int, limits: Limits, work: Callable[..., Any], remedy: str | None) -> Any:
    if code == DISK_FULL:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    if code:
        if remedy is None:
            remedy = _("Part it into several files, or import it with `inband import` at the server.")
        raise Unusable(f"{_reason(code, limits)} {remedy}".rstrip())
    done, outcome = pickle.loads(path.read_bytes())  # noqa: S301 - see above
    if done:
        return outcome
    if isinstance(outcome, Unusable | InbandError):
        raise outcome
    log.error("%s failed in a process of its own:\n%s", work.__name__, outcome)
    raise Unusable(_("This file cannot be read: {error}.").format(error=outcome.rstrip().rpartition("\n")[2][:200]))


def _reason(code: int, limits: Limits) -> str:
    if code in ENDED_BY_TIME:
        return _("This file takes longer to read than the {most} s that it may.").format(most=limits.seconds)
    if code == OUT_OF_MEMORY:
        most = limits.memory // MEGABYTE
        return _("This file takes more memory to read than the {most} MB that it may.").format(most=most)
    if code == OUT_OF_ROOM:
        most = limits.written // MEGABYTE
        return _("What this file unpacks to is more than the {most} MB that it may be.").format(most=most)
    log.error("a process that read a file ended with %d", code)
    return _("The program that reads files has ended on this one.")


def spend(size: int) -> None:
    """Say that N bytes are written. Beyond the limit of this process it raises `OSError`."""
    global _room  # noqa: PLW0603 - of the process, as the limits are
    if _room is not None:
        _room -= size
        if _room < 0:
            raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))


def sweep() -> None:
    """Remove what a killed server has left behind, a day later."""
    for old in Path(gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if old.stat().st_mtime < time.time() - YESTERDAY:
                shutil.rmtree(old)


# --- in the process of its own


def begin() -> None:
    """Do the task of the folder named on the command line."""
    folder, parent = Path(sys.argv[1]), int(sys.argv[2])
    end_with(parent)
    limits, language, work, given = pickle.loads((folder / "task").read_bytes())  # noqa: S301 - of our own server
    _keep(limits)
    try:
        outcome = pickle.dumps(_done(language, work, given))
        (folder / "result").write_bytes(outcome)
    except MemoryError:
        os._exit(OUT_OF_MEMORY)
    except OSError as error:
        if error.errno == errno.EFBIG:
            os._exit(OUT_OF_ROOM)
        if error.errno in {errno.ENOSPC, errno.EDQUOT}:
            os._exit(DISK_FULL)
        raise
    os._exit(0)  # a million objects need no clearing away


def _done(language: str, work: Callable[..., Any], given: tuple[Any, ...]) -> tuple[bool, Any]:
    try:
        with speaking(language):
            return True, work(*given)
    except MemoryError:
        raise
    except (Unusable, InbandError) as error:
        return False, error
    except Exception as error:  # whatever a file makes of a library is no trouble of the server
        if isinstance(error, OSError) and error.errno in {errno.EFBIG, errno.ENOSPC, errno.EDQUOT}:
            raise
        return False, traceback.format_exc(-5)


def end_with(parent: int) -> None:
    """End this process when that one does, however that ends. Does nothing elsewhere than on Linux.

    To the system the parent is the thread that began this process: it has to wait for it.
    """
    if sys.platform == "linux":
        import ctypes

        set_death_signal = 1
        ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def _keep(limits: Limits) -> None:
    global _room  # noqa: PLW0603 - of the process
    _room = limits.written
    sys.modules["numpy"] = None  # type: ignore[assignment] # openpyxl does without, and begins in half the time
    try:
        import resource
    except ModuleNotFoundError:  # Windows: the clock of the server is the only limit
        return
    for kind, most in (
        (resource.RLIMIT_CPU, limits.seconds),
        (resource.RLIMIT_DATA, limits.memory),
        (resource.RLIMIT_FSIZE, limits.written),
        (resource.RLIMIT_CORE, 0),
    ):
        with suppress(OSError, ValueError):  # a stricter one is there already
            resource.setrlimit(kind, (most, most + (kind == resource.RLIMIT_CPU)))
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
