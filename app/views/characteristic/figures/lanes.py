"""The two lanes of the zone chart: events above the readings, the sum of the corrections below them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from app.language.i18n import _
from app.language.numbers import um
from app.loop.tools.wording import status_word
from app.web.theme import ZONE_SYMBOLS, Palette

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


def _alarm_colour(kind: str, colours: Palette) -> str:
    if kind == "probe_fault":
        return colours.stop
    if kind == "tool_worn":
        return colours.wear
    if kind in (TOOL_CHANGE, MANUAL_EDIT):
        return colours.correction
    return colours.attention


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


def event_lane(
    marks: Sequence[Mark], span: tuple[float, float], pixels: int, colours: Palette
) -> tuple[list[dict[str, Any]], list[dict[str, Any]], list[dict[str, Any]]]:
    """Traces, words and vertical lines (tool changes, edits) of the events. A word is left out where it would not fit."""
    marks = [mark for mark in marks if span[0] <= mark.sequence <= span[1]]
    if not marks:
        return [], [], []
    places = _rows(marks, span, pixels)
    marks = [mark for mark, _row, _written in places]
    trace = {
        "type": "scatter",
        "mode": "markers",
        "name": _("Alarm or tool change"),
        "meta": "events",
        "showlegend": False,
        "x": [mark.sequence for mark in marks],
        "y": [row for _mark, row, _written in places],
        "yaxis": "y2",
        "marker": {
            "symbol": [_alarm_symbol(mark.kind) for mark in marks],
            "size": 12,
            "color": [_alarm_colour(mark.kind, colours) for mark in marks],
            "line": {"width": 1.5, "color": [_alarm_colour(mark.kind, colours) for mark in marks]},
        },
        "customdata": [mark.link for mark in marks],
        "text": [f"<b>{mark.text}</b><br>{_('Reading {n}').format(n=mark.sequence)}" for mark in marks],
        "hovertemplate": "%{text}<extra></extra>",
        "cliponaxis": False,
    }
    words = [
        {
            "xref": "x",
            "x": mark.sequence,
            "xanchor": "left",
            "xshift": 9,
            "yref": "y2",
            "y": row,
            "yanchor": "middle",
            "text": f"<b>{mark.text}</b>" if mark.active else mark.text,
            "showarrow": False,
            "font": {"size": 12, "color": _alarm_colour(mark.kind, colours)},
        }
        for mark, row, written in places
        if written
    ]
    lines = [
        {
            "type": "line",
            "layer": "below",
            "xref": "x",
            "x0": mark.sequence,
            "x1": mark.sequence,
            "yref": "paper",
            "y0": 0,
            "y1": 0.94,
            "line": {"color": colours.correction, "width": 1.25, "dash": "dot"},
        }
        for mark in marks
        if mark.kind in (TOOL_CHANGE, MANUAL_EDIT)
    ]
    return [trace], words, lines


def offset_lane(
    steps: Sequence[Step],
    marks: Sequence[Mark],
    span: tuple[float, float],
    total_before: float,
    colours: Palette,
    *,
    brief: bool = False,
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
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
    colour = colours.correction
    course = {
        "type": "scatter",
        "mode": "lines",
        "name": _("Sum of corrections"),
        "meta": "offset",
        "x": x,
        "y": y,
        "yaxis": "y3",
        "line": {"width": 2, "color": colour, "shape": "hv"},
        "hoverinfo": "skip",
    }
    dots = {
        "type": "scatter",
        "mode": "markers",
        "name": _("Correction"),
        "meta": "corrections",
        "showlegend": False,
        "x": [step.sequence for step, _total in at],
        "y": [value for _step, value in at],
        "yaxis": "y3",
        "marker": {
            "symbol": [STEP_SYMBOLS.get(step.status, "circle") for step, _total in at],
            "size": 8 if len(at) <= 30 else 6,
            "color": [colours.wear if step.status == "held" else colour for step, _total in at],
            "line": {"width": 1.5, "color": [colours.wear if step.status == "held" else colour for step, _total in at]},
        },
        "customdata": [step.link for step, _total in at],
        "text": [
            f"<b>{_('Correction {n}').format(n=step.number)}</b><br>{um(step.amount)} · {status_word(step.status)}"
            f"<br>{_('Reading {n}').format(n=step.sequence)}"
            for step, _total in at
        ],
        "hovertemplate": "%{text}<extra></extra>",
        "cliponaxis": False,
    }
    notes: list[dict[str, Any]] = []
    if at:
        newest, value = at[-1]
        words = _("correction {n}: {amount}, {status}").format(
            n=newest.number, amount=um(newest.amount), status=status_word(newest.status)
        )
        notes.append(
            {
                "xref": "paper",
                "x": 1,
                "xanchor": "left",
                "xshift": 8,
                "yref": "y3 domain",
                "y": 0.5,
                "yanchor": "middle",
                "align": "left",
                "showarrow": False,
                "text": f"<b>Σ {um(value / 1000)}</b>" + ("" if brief else f"<br>{words}"),
                "font": {"size": 12, "color": colour},
            }
        )
    return [course, *([dots] if at else [])], notes
