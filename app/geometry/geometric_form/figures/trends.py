"""The deviations of a feature over time, with tolerance and uncertainty."""

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from app.charts import Axis, Chart, Dots, Panel, Pen, Role, Series, Spread, nothing, time_axis
from app.geometry.geometric_form.figures.parts import ROOM
from app.language.i18n import _

SYMBOLS = {
    None: "circle-open",
    "good": "circle",
    "good_unsure": "circle-dot",
    "bad_unsure": "triangle-up-open",
    "bad": "triangle-up",
}


class Mark(NamedTuple):
    """A measurement as it is drawn; mm."""

    at: datetime
    number: int
    value: float
    uncertainty: float | None
    tolerance: float | None
    verdict: str | None
    word: str
    suspects: int


def trend(marks: Sequence[Mark]) -> Chart:
    """One mark per measurement, its shape by the verdict; the tolerance as steps."""
    if not marks:
        return nothing(_("Not measured yet"))
    drawn: list[Series] = []
    limited = [mark for mark in marks if mark.tolerance is not None]
    if limited:
        drawn.append(
            Series(
                [mark.at for mark in limited],
                [(mark.tolerance or 0.0) * 1000 for mark in limited],
                Pen("quiet", dash="dash", steps="hv"),
                Dots("line-ew-open", 24, "quiet") if len(limited) == 1 else None,
                name=_("Tolerance"),
            )
        )
    for verdict, symbol in SYMBOLS.items():
        chosen = [mark for mark in marks if mark.verdict == verdict]
        if not chosen:
            continue
        tone: Role = "attention" if verdict in {"bad", "bad_unsure"} else "steady"
        drawn.append(
            Series(
                [mark.at for mark in chosen],
                [mark.value * 1000 for mark in chosen],
                dots=Dots(symbol, 11, tone, tone),
                spread=Spread([(mark.uncertainty or 0.0) * 1000 for mark in chosen], colour="faint"),
                meta=verdict or "",
                name=chosen[0].word,
                hover=[
                    _("measurement {n}: {value:.1f} µm, {word}").format(
                        n=mark.number, value=mark.value * 1000, word=mark.word
                    )
                    + (_(", suspect points") if mark.suspects else "")
                    for mark in chosen
                ],
                links=[f"/forms/{mark.number}" for mark in chosen],
            )
        )
    highest = max(
        [mark.value + (mark.uncertainty or 0.0) for mark in marks] + [mark.tolerance or 0.0 for mark in marks]
    )
    height = Axis(_("Deviation, µm"), reach=(0, max(highest, 1e-6) * 1120), ticks=6)
    return Chart([Panel(drawn, height)], time_axis([mark.at for mark in marks]), ROOM)
