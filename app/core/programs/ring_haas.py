"""The programs of the ring for Haas NGC: Fanuc's user macros, with a look-ahead of its own.

``G103 P1`` and empty blocks behind it keep the control from reading variables ahead (Haas 96-8000, macros; public macros that
wait for a computer leave a dozen empty). The measuring cycles' #150 to #199 and #550 to #599 are left alone.
"""

from collections.abc import Iterator

from app.core.programs.ring_fanuc import Fanuc
from app.core.programs.ring_steps import Alarm, Do, RingProgram, Step

EMPTY = ";"
AFTER_LIMIT, BETWEEN = 12, 3


class Haas(Fanuc):
    limited = False

    def lines(self, program: RingProgram) -> list[str]:
        """The steps of a program, its look-ahead limited from the first step that needs it to its end."""
        self.limited = False
        return super().lines(program)

    def _number(self, at: int) -> str:
        return f"O{self.settings.first_program + at:05}"

    def do(self, what: Do) -> Iterator[Step | str]:
        if what is Do.SYNC and not self.limited:
            self.limited = True
            yield "G103 P1"
            yield from [EMPTY] * AFTER_LIMIT
        elif what is Do.SYNC:
            yield from [EMPTY] * BETWEEN
        elif what is Do.PAUSE:
            yield "G04 P0.5"
        elif what is Do.RETURN and self.limited:
            yield "G103 P0"
            yield "M99"
        else:
            yield from super().do(what)

    def stop(self, alarm: Alarm) -> Iterator[str]:
        if self.limited:
            yield "G103 P0"
        yield from super().stop(alarm)
