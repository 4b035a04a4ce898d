"""The history of one tool's offset as a chart. Pure; lengths in mm in, µm or mm on the axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from app.language.i18n import _
from app.language.numbers import um
from app.language.times import local, on_axis
from app.web.theme import Palette, ThemeName, date_axis, layout, legend, palette

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


def offset_figure(changes: Sequence[OffsetChange], *, theme: ThemeName = "light") -> dict[str, Any]:
    """The offset over time as steps; every change a mark by its kind; tool changes as lines through the chart."""
    colours = palette(theme)
    changes = sorted(changes, key=lambda change: change.at)  # what is told late would draw a line back in time
    kinds = {
        "correction": _("Correction"),
        "edit": _("Manual edit"),
        "change": _("Tool changed"),
        "reported": _("Reported by the machine"),
    }
    at = [on_axis(change.at) for change in changes]
    traces: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": _("Offset"),
            "meta": "offset",
            "showlegend": False,
            "x": at,
            "y": [change.offset for change in changes],
            "line": {"width": 2, "color": colours.correction, "shape": "hv"},
            "hoverinfo": "skip",
        }
    ]
    for kind, name in kinds.items():
        chosen = [change for change in changes if change.kind == kind]
        if chosen:
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": name,
                    "meta": kind,
                    "x": [on_axis(change.at) for change in chosen],
                    "y": [change.offset for change in chosen],
                    "marker": {
                        "symbol": SYMBOLS[kind],
                        "size": 7 if kind == "correction" else 11,
                        "color": colours.correction if kind == "correction" else colours.ink,
                    },
                    "customdata": [change.link for change in chosen],
                    "text": [
                        f"<b>{name}</b><br>{_('offset {offset}').format(offset=um(change.offset))}"
                        + (f"<br>{change.text}" if change.text else "")
                        for change in chosen
                    ],
                    "hovertemplate": "%{text}<extra></extra>",
                    "cliponaxis": False,
                }
            )
    return {
        "data": traces,
        "layout": layout(
            theme,
            margin={"l": 84, "t": 34},
            showlegend=True,
            legend=legend(theme),
            xaxis=date_axis() | {"visible": bool(changes)},
            yaxis={
                "visible": bool(changes),
                "tickformat": "+.4f",
                "nticks": 6,
                "title": {"text": _("Offset, mm"), "font": {"size": 13, "color": colours.quiet}, "standoff": 8},
            },
            shapes=[
                {
                    "type": "line",
                    "layer": "below",
                    "x0": on_axis(change.at),
                    "x1": on_axis(change.at),
                    "yref": "paper",
                    "y0": 0,
                    "y1": 1,
                    "line": {"color": colours.faint, "width": 1.25, "dash": "dot"},
                }
                for change in changes
                if change.kind == "change"
            ],
            annotations=[]
            if changes
            else [
                {
                    "xref": "paper",
                    "yref": "paper",
                    "x": 0.5,
                    "y": 0.5,
                    "text": f"<b>{_('No correction or tool change yet')}</b>",
                    "showarrow": False,
                    "font": {"size": 15, "color": colours.quiet},
                }
            ],
        ),
    }


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
    theme: ThemeName = "light",
) -> dict[str, Any]:
    """Parts cut per edge, and below the sum of its corrections, oldest first; the present edge hatched."""
    colours = palette(theme)
    at = list(range(len(lives)))
    names = [_("now") if life.ended_at is None else local(life.ended_at).strftime("%d.%m.") for life in lives]
    lines = _planned_lines(lives, usual, planned_parts, planned_total)
    return {
        "data": _life_bars(lives, colours),
        "layout": layout(
            theme,
            margin={"l": 70, "t": 14, "r": 92, "b": 34},
            xaxis={
                "tickvals": at,
                "ticktext": names,
                "range": [-0.6, max(len(lives) - 0.4, 3.4)],
                "showgrid": False,
                "fixedrange": True,
                "anchor": "y2",
                "tickangle": 0,
            },
            yaxis={
                "domain": [0.56, 1],
                "rangemode": "tozero",
                "nticks": 4,
                "title": {"text": _("Parts"), "font": {"size": 13, "color": colours.quiet}},
                "fixedrange": True,
            },
            yaxis2={
                "domain": [0, 0.44],
                "anchor": "x",
                "nticks": 4,
                "tickformat": "+.0f",
                "color": colours.quiet,
                "gridcolor": colours.grid,
                "zeroline": True,
                "zerolinecolor": colours.faint,
                "title": {"text": _("Sum, µm"), "font": {"size": 13, "color": colours.quiet}},
                "fixedrange": True,
            },
            shapes=[
                {
                    "type": "line",
                    "xref": "paper",
                    "x0": 0,
                    "x1": 1,
                    "yref": axis,
                    "y0": value,
                    "y1": value,
                    "line": {"color": colours.faint if dash == "dot" else colours.ink, "width": 1.5, "dash": dash},
                }
                for value, axis, dash, _text, _shift in lines
            ],
            annotations=[
                {
                    "xref": "paper",
                    "x": 1,
                    "xanchor": "left",
                    "yref": axis,
                    "y": value,
                    "text": text,
                    "yshift": shift,
                    "showarrow": False,
                    "font": {"size": 12, "color": colours.quiet},
                }
                for value, axis, _dash, text, shift in lines
            ],
        ),
    }


def _life_bars(lives: Sequence[LifeBar], colours: Palette) -> list[dict[str, Any]]:
    present = [life.ended_at is None for life in lives]
    return [
        {
            "type": "bar",
            "meta": meta,
            "name": name,
            "x": list(range(len(lives))),
            "y": values,
            "yaxis": axis,
            "marker": {
                "color": colours.steady if meta == "parts" else colours.correction,
                "pattern": {"shape": ["/" if now else "" for now in present], "fillmode": "overlay"},
            },
            "width": 0.7,
            "text": texts,
            "textposition": "none",
            "hovertemplate": "%{text}<extra></extra>",
        }
        for meta, name, axis, values, texts in (
            (
                "parts",
                _("Parts"),
                "y",
                [life.parts for life in lives],
                [_life_text(life, str(life.parts), _("parts")) for life in lives],
            ),
            (
                "total",
                _("Sum of corrections"),
                "y2",
                [None if life.total is None else life.total * 1000 for life in lives],
                [_life_text(life, um(life.total), _("corrected in all")) for life in lives],
            ),
        )
    ]


def _planned_lines(
    lives: Sequence[LifeBar], usual: float | None, planned_parts: int | None, planned_total: float | None
) -> list[tuple[float, str, str, str, int]]:
    """Value, axis, dash, words and shift of the words, px, of each line across the bars."""
    sign = -1 if sum(life.total or 0.0 for life in lives) < 0 else 1
    near = (
        usual is not None
        and planned_parts is not None
        and abs(usual - planned_parts) < 0.15 * max(usual, planned_parts)
    )
    apart = (9 if (usual or 0) >= (planned_parts or 0) else -9) if near else 0  # so that their words do not meet
    return [
        (value, axis, dash, text, shift)
        for value, axis, dash, text, shift in (
            (usual, "y", "dot", _("median {n}").format(n=f"{usual or 0:g}"), apart),
            (planned_parts, "y", "dash", _("planned {n}").format(n=planned_parts), -apart),
            (None if planned_total is None else sign * planned_total * 1000, "y2", "dash", _("planned"), 0),
        )
        if value is not None
    ]


def _life_text(life: LifeBar, value: str, what: str) -> str:
    return f"<b>{life.edge or _('Edge')}</b><br>{value} {what}"
