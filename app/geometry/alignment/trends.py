"""Chart of one set-up's position over time. Pure; shifts in mm in, µm on the axis; turns in degrees."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

from app.language.i18n import _
from app.language.numbers import signed
from app.language.times import on_axis
from app.web.theme import ThemeName, date_axis, layout, legend, palette


class Mark(NamedTuple):
    """An alignment as it is drawn over time: shifts in mm, turns in degrees."""

    at: datetime
    number: int
    shift: Sequence[float]
    turns: Sequence[float]
    doubted: bool


def trend(marks: Sequence[Mark], *, theme: ThemeName = "light") -> dict[str, Any]:
    """Shifts above, turns below, one line for each axis, told apart by their marks as well."""
    colours = palette(theme)
    tones, dashes = (colours.ink, colours.correction, colours.wear), ("solid", "dash", "dot")
    data = []
    for axis, (name, symbol) in enumerate(zip("XYZ", ("circle", "square", "diamond"), strict=True)):
        for below, scale, unit in ((False, 1000, "µm"), (True, 1, "°")):
            values = [(mark.turns if below else mark.shift)[axis] * scale for mark in marks]
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers",
                    "name": name,
                    "legendgroup": name,
                    "showlegend": not below,
                    "x": [on_axis(mark.at) for mark in marks],
                    "y": values,
                    "yaxis": "y2" if below else "y",
                    "line": {"color": tones[axis], "width": 1.5, "dash": dashes[axis]},
                    "marker": {"symbol": symbol, "size": 8, "color": tones[axis]},
                    "customdata": [f"/alignments/{mark.number}" for mark in marks],
                    "text": [
                        _("alignment {n}: {axis} {value} {unit}").format(
                            n=mark.number, axis=name, value=signed(value, 4 if below else 1), unit=unit
                        )
                        for mark, value in zip(marks, values, strict=True)
                    ],
                    "hovertemplate": "%{text}<extra></extra>",
                    "cliponaxis": False,
                }
            )

    def titled(text: str) -> dict[str, Any]:
        return {"title": {"text": text, "font": {"size": 13, "color": colours.quiet}, "standoff": 8}, "zeroline": True}

    frame = layout(
        theme,
        margin={"l": 72, "r": 16, "t": 36, "b": 48},
        showlegend=True,
        legend=legend(theme),
        xaxis=date_axis((mark.at for mark in marks), anchor="y2"),
        yaxis=titled(_("Shift, µm")) | {"domain": [0.54, 1], "tickformat": "+.4~g", "zerolinecolor": colours.faint},
    )
    frame["yaxis2"] = frame["yaxis"] | titled(_("Turn, °")) | {"domain": [0, 0.46]}
    return {"data": data, "layout": frame}
