"""The lane below the readings of the zone chart: the sum of the corrections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.charts import Dots, Note, Pen, Role, Series, Share, bold
from app.language.formatting import read_um
from app.language.i18n import _
from app.loop.timeline.figures import TOOL_CHANGE, Event
from app.loop.tools.wording import status_word

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


def offset_lane(
    steps: Sequence[Step],
    events: Sequence[Event],
    span: tuple[float, float],
    total_before: float,
    *,
    half: float,
    brief: bool = False,
) -> list[Series | Note]:
    """The sum of the corrections since the tool was changed as steps; each correction a mark by its status.

    half: of the tolerance, mm. brief: beside it the sum alone, without the newest correction.
    """
    course: list[tuple[float, int, Step | None]] = [(step.sequence, 1, step) for step in steps]
    course += [(event.at, 0, None) for event in events if event.kind == TOOL_CHANGE and isinstance(event.at, int)]
    total = total_before
    x: list[float] = [span[0]]
    y: list[float] = [round(total * 1000, 6)]
    at: list[tuple[Step, float]] = []
    for sequence, _order, step in sorted(course, key=lambda place: place[:2]):
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
                bold(_("Correction {n}").format(n=step.number))
                + f"<br>{read_um(step.amount, half)} · {status_word(step.status)}<br>"
                + _("Reading {n}").format(n=step.sequence)
                for step, _total in at
            ],
            links=[step.link for step, _total in at],
        )
    )
    newest, value = at[-1]
    words = _("correction {n}: {amount}, {status}").format(
        n=newest.number, amount=read_um(newest.amount, half), status=status_word(newest.status)
    )
    text = f"<b>Σ {read_um(value / 1000, half)}</b>" + ("" if brief else f"<br>{words}")
    return [*marked, Note(text, Share(1), Share(0.5, inside=True), "left", shift=(8, 0), colour="correction")]
