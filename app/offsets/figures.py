"""The history of one tool's offset as a chart. Pure; lengths in mm in, µm or mm on the axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from app.web.i18n import _
from app.web.numbers import um
from app.web.theme import ThemeName, date_axis, layout, palette

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
    kinds = {
        "correction": _("Correction"),
        "edit": _("Manual edit"),
        "change": _("Tool changed"),
        "reported": _("Reported by the machine"),
    }
    at = [change.at.isoformat() for change in changes]
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
                    "x": [change.at.isoformat() for change in chosen],
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
            legend={
                "orientation": "h",
                "x": 0,
                "xanchor": "left",
                "y": 1.02,
                "yanchor": "bottom",
                "font": {"size": 13, "color": colours.quiet},
                "itemclick": False,
                "itemdoubleclick": False,
            },
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
                    "x0": change.at.isoformat(),
                    "x1": change.at.isoformat(),
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
                    "text": f"<b>{_('No offset known yet')}</b>",
                    "showarrow": False,
                    "font": {"size": 15, "color": colours.quiet},
                }
            ],
        ),
    }
