"""Refusal of a reading with more touches than its characteristic can have (decision 53). It asks the machine to stop, as an answer does."""

from typing import Any

from app.core.probing import TouchError
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.readings.records import Entry
from app.loop.readings.wording import touch_problem

STOP: dict[str, Any] = {"action": "stop"}


class TooManyTouches(Invalid):
    """The refusal. entry: of the reading; touch: the one too many."""

    def __init__(self, entry: Entry, touch: TouchError) -> None:
        message = touch_problem(touch)
        super().__init__(
            message,
            _("Nothing was stored. Correct points or repeats of the characteristic, or what the program sends."),
            errors=[FieldError("touches", message)],
            **STOP,
        )
        self.entry, self.touch = entry, touch
