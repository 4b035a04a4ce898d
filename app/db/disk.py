"""Room on the disk that the data directory lies on, which is to be seen before there is none."""

import logging
import shutil
import threading
import time
from contextlib import suppress
from pathlib import Path

log = logging.getLogger(__name__)

LEAST = 1_000_000_000  # bytes
NOTHING = 20_000_000  # bytes; a log segment of PostgreSQL needs 16 MB
LOOK_EVERY = 60.0  # s
SAY_EVERY = 3600.0  # s


def free(data_dir: Path) -> int:
    """Bytes that are free there, or where the folder would be made. Raises `OSError`."""
    there = next(folder for folder in (data_dir, *data_dir.parents) if folder.exists())
    return shutil.disk_usage(there).free


def is_full(data_dir: Path) -> bool:
    """Tell if nothing can be stored there. A disk that does not tell is not full."""
    with suppress(OSError):
        return free(data_dir) < NOTHING
    return False


def shortage(data_dir: Path) -> str | None:
    """Warning for a disk with less than `LEAST` free, with what to do; None when there is enough."""
    left = free(data_dir)
    if left >= LEAST:
        return None
    return (
        f"The disk of {data_dir} is nearly full: {left / 1e6:,.0f} MB are free, {LEAST / 1e6:,.0f} MB are wanted. "
        "Make room, or move the data folder to a larger disk; on a full one nothing can be stored."
    )


def watch(data_dir: Path) -> None:
    """Log a warning as long as the disk is nearly full, at once and then every hour; in a thread of its own."""
    threading.Thread(target=_watch, args=(data_dir,), name="disk", daemon=True).start()


def _watch(data_dir: Path) -> None:
    warned_at: float | None = None
    while True:
        try:
            words = shortage(data_dir)
        except OSError as error:
            words = f"The room on the disk of {data_dir} cannot be read: {error}"
        if words is None:
            warned_at = None
        elif warned_at is None or time.monotonic() - warned_at >= SAY_EVERY:
            warned_at = time.monotonic()
            log.warning("%s", words)
        time.sleep(LOOK_EVERY)
