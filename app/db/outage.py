"""Log lines of an outage of the database: one when it interrupts some work, one when that goes on."""

from logging import Logger
from time import monotonic


class Outage:
    """An outage as one piece of work meets it, however often that is tried again meanwhile."""

    def __init__(self, log: Logger, work: str) -> None:
        self._log = log
        self._work = work
        self._since: float | None = None

    def goes_on(self, error: Exception) -> None:
        """Note that the database could not be used; the first time, log it."""
        if self._since is None:
            self._since = monotonic()
            self._log.warning("%s are interrupted: %s", self._work, error)

    def is_over(self) -> None:
        """Note that the database was used; after an outage, log it."""
        if self._since is not None:
            self._log.info("%s go on after an interruption of %.0f s", self._work, monotonic() - self._since)
            self._since = None
