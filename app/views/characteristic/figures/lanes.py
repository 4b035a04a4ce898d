"""The two lanes of the zone chart: events above the readings, the sum of the corrections below them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from app.charts import Dots, Note, Pen, Role, Rule, Series, Share
from app.language.i18n import _
from app.language.numbers import um
from app.loop.tools.wording import status_word
from app.web.theme import ZONE_SYMBOLS

TOOL_CHANGE = "tool_change"
MANUAL_EDIT = "manual_edit"

# Statuses whose amount is in the tool memory, or on its way to it.
COUNTED = frozenset({"pending", "applied"})
STEP_SYMBOLS = {
    "applied": "circle",
    "pending": "circle-open",
    "awaiting_approval": "diamond-open",
    "held": "hexagon2-open",
    "rejected": "x-thin-open",
    "superseded": "line-ew-open",
}
LETTER = (
    6.5  # pixels that a letter of an event takes, about: words that would run into each other are left to the shapes
)
RIGHT_ROOM = 200  # pixels that a word may reach out beside the readings
UPPER, LOWER = 0.5, -0.5  # rows of the events


@dataclass(frozen=True)
class Step:
    """One correction; `sequence` is the reading that caused it, `amount` what the offset changes by (mm).

    total: the sum after it (mm), where corrections before it are left out and it cannot be added up.
    """

    sequence: int
    number: int
    amount: float
    status: str
    link: str | None = None
    total: float | None = None


@dataclass(frozen=True)
class Mark:
    """One event: an alarm (`kind` is the alarm's kind) or `tool_change` / `manual_edit`; `text` is its word."""

    sequence: int
    kind: str
    text: str
    link: str | None = None
    active: bool = False


def _alarm_colour(kind: str) -> Role:
    if kind == "probe_fault":
        return "stop"
    if kind == "tool_worn":
        return "wear"
    return "correction" if kind in (TOOL_CHANGE, MANUAL_EDIT) else "attention"


def _alarm_symbol(kind: str) -> str:
    if kind == "tool_worn":
        return ZONE_SYMBOLS["wear"]
    if kind == TOOL_CHANGE:
        return "triangle-down-open"
    if kind == MANUAL_EDIT:
        return "square-open"
    return ZONE_SYMBOLS.get(kind, "star-triangle-up")


def _rows(marks: Sequence[Mark], span: tuple[float, float], pixels: int) -> list[tuple[Mark, float, bool]]:
    """Each mark with its row and whether its word is written: two rows, and a word gives way to the next mark's shape."""
    places: list[tuple[Mark, float, bool]] = []
    latest = {UPPER: -1, LOWER: -1}  # index of the last mark in the row
    end = {UPPER: -inf, LOWER: -inf}  # where its word ends, px
    for mark in sorted(marks, key=lambda mark: mark.sequence):
        start = (mark.sequence - span[0]) / (span[1] - span[0]) * pixels - 8
        row = UPPER if end[UPPER] <= start else min(end, key=lambda row: end[row])
        if end[row] > start:
            before, _row, _written = places[latest[row]]
            places[latest[row]] = (before, row, False)
        stop = start + 20 + LETTER * len(mark.text)
        written = stop < pixels + RIGHT_ROOM
        latest[row], end[row] = len(places), stop if written else start + 18
        places.append((mark, row, written))
    return places


def event_lane(marks: Sequence[Mark], span: tuple[float, float], pixels: int) -> list[Series | Rule | Note]:
    """Marks, words and vertical lines (tool changes, edits) of the events. A word is left out where it would not fit."""
    places = _rows([mark for mark in marks if span[0] <= mark.sequence <= span[1]], span, pixels)
    if not places:
        return []
    marks = [mark for mark, _row, _written in places]
    colours = [_alarm_colour(mark.kind) for mark in marks]
    return [
        *(
            Rule(Pen("correction", 1.25, "dot"), x=mark.sequence, upto=0.94)
            for mark in marks
            if mark.kind in (TOOL_CHANGE, MANUAL_EDIT)
        ),
        Series(
            [mark.sequence for mark in marks],
            [row for _mark, row, _written in places],
            dots=Dots([_alarm_symbol(mark.kind) for mark in marks], 12, colours, edge=colours),
            meta="events",
            hover=[f"<b>{mark.text}</b><br>{_('Reading {n}').format(n=mark.sequence)}" for mark in marks],
            links=[mark.link for mark in marks],
        ),
        *(
            Note(
                f"<b>{mark.text}</b>" if mark.active else mark.text,
                mark.sequence,
                row,
                "left",
                shift=(9, 0),
                colour=_alarm_colour(mark.kind),
            )
            for mark, row, written in places
            if written
        ),
    ]


def offset_lane(
    steps: Sequence[Step],
    marks: Sequence[Mark],
    span: tuple[float, float],
    total_before: float,
    *,
    brief: bool = False,
) -> list[Series | Note]:
    """The sum of the corrections since the tool was changed as steps; each correction a mark by its status.

    brief: beside it the sum alone, without the newest correction.
    """
    events: list[tuple[int, int, Step | None]] = [(step.sequence, 1, step) for step in steps]
    events += [(mark.sequence, 0, None) for mark in marks if mark.kind == TOOL_CHANGE]
    total = total_before
    x: list[float] = [span[0]]
    y: list[float] = [round(total * 1000, 6)]
    at: list[tuple[Step, float]] = []
    for sequence, _order, step in sorted(events, key=lambda event: event[:2]):
        if step is None:
            total = 0.0
        elif step.total is not None:
            total = step.total
        elif step.status in COUNTED:
            total += step.amount
        if sequence < span[0]:  # counts, but lies before what is shown
            y[0] = round(total * 1000, 6)
            continue
        x.append(sequence)
        y.append(round(total * 1000, 6))
        if step is not None:
            at.append((step, round(total * 1000, 6)))
    x.append(span[1])
    y.append(y[-1])
    marked: list[Series | Note] = [
        Series(x, y, Pen("correction", 2, steps="hv"), meta="offset", name=_("Sum of corrections"))
    ]
    if not at:
        return marked
    colours: list[Role] = ["wear" if step.status == "held" else "correction" for step, _total in at]
    symbols = [STEP_SYMBOLS.get(step.status, "circle") for step, _total in at]
    marked.append(
        Series(
            [step.sequence for step, _total in at],
            [value for _step, value in at],
            dots=Dots(symbols, 8 if len(at) <= 30 else 6, colours, edge=colours),
            meta="corrections",
            hover=[
                f"<b>{_('Correction {n}').format(n=step.number)}</b><br>{um(step.amount)} · {status_word(step.status)}"
                f"<br>{_('Reading {n}').format(n=step.sequence)}"
                for step, _total in at
            ],
            links=[step.link for step, _total in at],
        )
    )
    newest, value = at[-1]
    words = _("correction {n}: {amount}, {status}").format(
        n=newest.number, amount=um(newest.amount), status=status_word(newest.status)
    )
    text = f"<b>Σ {um(value / 1000)}</b>" + ("" if brief else f"<br>{words}")
    return [*marked, Note(text, Share(1), Share(0.5, inside=True), "left", shift=(8, 0), colour="correction")]
