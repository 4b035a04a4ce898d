"""The history of one tool's offset as a chart. Pure; lengths in mm in, µm or mm on the axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from app.charts import Axis, Bars, Chart, Dots, Mark, Panel, Pen, Room, Rule, Series, bold, nothing, time_axis
from app.language.formatting import um
from app.language.i18n import _
from app.language.times import local

SYMBOLS = {"correction": "circle", "edit": "square", "change": "triangle-down", "reported": "diamond"}


@dataclass(frozen=True)
class OffsetChange:
    """The offset (mm) after something changed it.

    kind: `correction`, `edit` (by hand), `change` (of the tool) or `reported` (the machine said it differs); text: its words.
    """

    at: datetime
    offset: float
    kind: str
    text: str = ""
    link: str | None = None


def offset_figure(changes: Sequence[OffsetChange]) -> Chart:
    """The offset over time as steps; every change a mark by its kind; tool changes as lines through the chart."""
    changes = sorted(changes, key=lambda change: change.at)  # what is reported late would draw a line back in time
    if not changes:
        return nothing(_("No correction or tool change yet"))
    kinds = {
        "correction": _("Correction"),
        "edit": _("Manual edit"),
        "change": _("Tool changed"),
        "reported": _("Reported offset"),
    }
    course = Pen("correction", 2, steps="hv")
    marks: list[Mark] = [Rule(Pen("faint", 1.25, "dot"), x=change.at) for change in changes if change.kind == "change"]
    marks.append(
        Series([change.at for change in changes], [change.offset for change in changes], course, meta="offset")
    )
    for kind, name in kinds.items():
        chosen = [change for change in changes if change.kind == kind]
        if chosen:
            marks.append(
                Series(
                    [change.at for change in chosen],
                    [change.offset for change in chosen],
                    dots=Dots(SYMBOLS[kind], 7, "correction")
                    if kind == "correction"
                    else Dots(SYMBOLS[kind], 11, "ink"),
                    name=name,
                    meta=kind,
                    links=[change.link for change in chosen],
                    hover=[
                        f"<b>{name}</b><br>"
                        + _("offset {offset}").format(offset=um(change.offset))
                        + (f"<br>{change.text}" if change.text else "")
                        for change in chosen
                    ],
                )
            )
    return Chart([Panel(marks, Axis(_("Offset, mm"), format="+.4f", ticks=6))], time_axis(), Room(left=84))


MOST_NAMES = 4  # below the bars of lives, side by side on a phone


@dataclass(frozen=True)
class LifeBar:
    """One edge in the chart of lives. total: sum of its corrections, mm; ended_at is None for the present one."""

    parts: int
    total: float | None
    ended_at: datetime | None
    edge: str | None = None


def lives_figure(
    lives: Sequence[LifeBar],
    *,
    usual: float | None = None,
    planned_parts: int | None = None,
    planned_total: float | None = None,
) -> Chart:
    """Parts cut per edge, and below the sum of its corrections, oldest first; the present edge hatched."""
    at = list(range(len(lives)))
    present = [life.ended_at is None for life in lives]
    parts = Bars(
        at,
        [life.parts for life in lives],
        width=0.7,
        hatched=present,
        meta="parts",
        hover=[_life_text(life, str(life.parts), _("parts")) for life in lives],
    )
    total = Bars(
        at,
        [None if life.total is None else life.total * 1000 for life in lives],
        "correction",
        width=0.7,
        hatched=present,
        meta="total",
        hover=[_life_text(life, um(life.total), _("corrected in all")) for life in lives],
    )
    named = _named(lives)
    reach = (-0.6, max(len(lives) - 0.4, 3.4))
    sign = -1 if sum(life.total or 0.0 for life in lives) < 0 else 1
    planned = None if planned_total is None else sign * planned_total * 1000
    return Chart(
        [
            Panel(
                [parts, *_parts_lines(usual, planned_parts)],
                Axis(_("Parts"), from_zero=True, ticks=4, fixed=True),
                (0.56, 1),
            ),
            Panel(
                [
                    total,
                    *(
                        []
                        if planned is None
                        else [Rule(Pen("ink", dash="dash"), planned, front=True, words=_("planned"))]
                    ),
                ],
                Axis(_("Sum, µm"), ticks=4, format="+.0f", zero="faint", fixed=True),
                (0, 0.44),
            ),
        ],
        Axis(at=[at for at, _name in named], words=[name for _at, name in named], reach=reach, grid=False, fixed=True),
        Room(left=70, top=14, right=92, bottom=34),
    )


def _named(lives: Sequence[LifeBar]) -> list[tuple[int, str]]:
    """The bars that have room for their day below them: from the present one back, one of each day."""
    apart = max(1.0, len(lives) / MOST_NAMES)
    named: list[tuple[int, str]] = []
    for at, life in reversed(list(enumerate(lives))):
        name = _("now") if life.ended_at is None else local(life.ended_at).strftime("%d.%m.")
        if not named or (named[-1][0] - at >= apart and named[-1][1] != name):
            named.append((at, name))
    return named[::-1]


def _parts_lines(usual: float | None, planned: int | None) -> list[Rule]:
    """The median and the plan across the bars; their words apart, so that they do not meet."""
    near = usual is not None and planned is not None and abs(usual - planned) < 0.15 * max(usual, planned)
    apart = (9 if (usual or 0) >= (planned or 0) else -9) if near else 0
    rules = []
    if usual is not None:
        rules.append(
            Rule(
                Pen("faint", dash="dot"), usual, front=True, words=_("median {n}").format(n=f"{usual:g}"), raised=apart
            )
        )
    if planned is not None:
        rules.append(
            Rule(Pen("ink", dash="dash"), planned, front=True, words=_("planned {n}").format(n=planned), raised=-apart)
        )
    return rules


def _life_text(life: LifeBar, value: str, what: str) -> str:
    return bold(life.edge or _("Edge")) + f"<br>{value} {what}"
