"""Chart of a fixture's shift over time. Pure; lengths in mm in, µm on the axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import hypot
from typing import Any

from app.language.i18n import _
from app.language.numbers import um
from app.language.times import on_axis
from app.web.theme import ThemeName, date_axis, layout, legend, palette

SYMBOLS = {"x": "circle", "y": "square", "z": "diamond"}
DASHES = {"x": "solid", "y": "dash", "z": "dot"}


@dataclass(frozen=True)
class Mark:
    """One zero. shifts: by axis, mm; state: as `core.geometry.work_zero.Shift`."""

    number: int
    at: datetime
    shifts: dict[str, float]
    state: str
    offset: str


def _tone(mark: Mark, axis: str, warning: float | None, colours: Any, quiet: str) -> str:
    """The colour of an axis of a zero that has shifted: of the axis that has most, and of those that would do it alone."""
    size = abs(mark.shifts[axis])
    to_blame = size >= max(map(abs, mark.shifts.values())) or (warning is not None and size > warning)
    if mark.state in {"alarm", "warning"} and to_blame:
        return str(colours.stop if mark.state == "alarm" else colours.attention)
    return quiet


def shift_figure(
    marks: Sequence[Mark], warning: float | None, alarm: float | None, *, theme: ThemeName = "light"
) -> dict[str, Any]:
    """X, Y and Z of each zero against what the fixture is compared with, with the limits."""
    colours = palette(theme)
    tones = {"x": colours.ink, "y": colours.steady, "z": colours.quiet}
    traces = []
    for axis, symbol in SYMBOLS.items():
        mine = [mark for mark in marks if axis in mark.shifts]
        if not mine:
            continue
        outline = [_tone(mark, axis, warning, colours, tones[axis]) for mark in mine]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "name": axis.upper(),
                "meta": axis,
                "x": [on_axis(mark.at) for mark in mine],
                "y": [mark.shifts[axis] * 1000 for mark in mine],
                "line": {"width": 1.5, "color": tones[axis], "dash": DASHES[axis]},
                "marker": {"symbol": symbol, "size": 9, "color": outline},
                "customdata": [f"/work-zeros/{mark.number}" for mark in mine],
                "text": [
                    f"<b>{_('Work zero {n}').format(n=mark.number)}</b>, {mark.offset}<br>{axis.upper()} {um(mark.shifts[axis])}"
                    for mark in mine
                ],
                "hovertemplate": "%{text}<extra></extra>",
                "cliponaxis": False,
            }
        )
    together = [mark for mark in marks if len(mark.shifts) > 1]
    if together:
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": _("together"),
                "meta": "together",
                "x": [on_axis(mark.at) for mark in together],
                "y": [hypot(*mark.shifts.values()) * 1000 for mark in together],
                "line": {"width": 5, "color": colours.grid},
                "hoverinfo": "skip",
            }
        )
        traces.insert(0, traces.pop())  # behind the others
    shapes: list[dict[str, Any]] = []
    names: list[dict[str, Any]] = []
    for limit, word, tone in ((warning, _("warning"), colours.attention), (alarm, _("alarm"), colours.stop)):
        if limit is None:
            continue
        shapes += [
            {
                "type": "line",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": height * 1000,
                "y1": height * 1000,
                "line": {"width": 1.5, "dash": "dash", "color": tone},
            }
            for height in (-limit, limit)
        ]
        names.append(
            {
                "x": 0.004,
                "xref": "paper",
                "xanchor": "left",
                "y": limit * 1000,
                "yanchor": "bottom",
                "showarrow": False,
                "text": word,
                "font": {"size": 12, "color": tone},
            }
        )
    heights = [abs(value) for mark in marks for value in mark.shifts.values()]
    heights += [limit for limit in (warning, alarm) if limit is not None]
    reach = max([*heights, 0.001]) * 1150
    return {
        "data": traces,
        "layout": layout(
            theme,
            margin={"l": 84, "t": 34},
            showlegend=True,
            legend=legend(theme),
            xaxis=date_axis(mark.at for mark in marks),
            yaxis={
                "range": [-reach, reach],
                "tickformat": "+.4~g",
                "nticks": 7,
                "zeroline": True,
                "zerolinecolor": colours.faint,
                "title": {"text": _("Shift, µm"), "font": {"size": 13, "color": colours.quiet}, "standoff": 8},
            },
            shapes=shapes,
            annotations=names,
        ),
    }
