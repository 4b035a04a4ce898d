"""The deviations of a feature over time, with tolerance and uncertainty."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

from app.geometry.geometric_form.figures.parts import framed, line, note, titled
from app.language.i18n import _
from app.language.times import on_axis
from app.web.theme import ThemeName, date_axis, palette

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


def trend(marks: Sequence[Mark], *, theme: ThemeName = "light") -> dict[str, Any]:
    """One mark per measurement, its shape by the verdict; the tolerance as steps."""
    colours = palette(theme)
    if not marks:
        words = note(_("Not measured yet"), colours, x=0.5, y=0.5, xref="paper", yref="paper")
        hidden = {"visible": False}
        return {"data": [], "layout": framed(theme, xaxis=hidden, yaxis=hidden, annotations=[words])}
    data: list[dict[str, Any]] = []
    limited = [mark for mark in marks if mark.tolerance is not None]
    if limited:
        data.append(
            line(
                [on_axis(mark.at) for mark in limited],
                [(mark.tolerance or 0.0) * 1000 for mark in limited],
                colours.quiet,
                _("Tolerance"),
                line={"dash": "dash", "shape": "hv"},
                mode="lines+markers" if len(limited) == 1 else "lines",
                marker={"symbol": "line-ew-open", "size": 24},
            )
        )
    for verdict, symbol in SYMBOLS.items():
        chosen = [mark for mark in marks if mark.verdict == verdict]
        if not chosen:
            continue
        tone = colours.attention if verdict in {"bad", "bad_unsure"} else colours.steady
        data.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": chosen[0].word,
                "meta": verdict,
                "x": [on_axis(mark.at) for mark in chosen],
                "y": [mark.value * 1000 for mark in chosen],
                "error_y": {
                    "type": "data",
                    "array": [(mark.uncertainty or 0.0) * 1000 for mark in chosen],
                    "color": colours.faint,
                    "thickness": 1.5,
                    "width": 4,
                },
                "marker": {"symbol": symbol, "size": 11, "color": tone, "line": {"width": 1.5, "color": tone}},
                "customdata": [f"/forms/{mark.number}" for mark in chosen],
                "text": [
                    _("measurement {n}: {value:.1f} µm, {word}").format(
                        n=mark.number, value=mark.value * 1000, word=mark.word
                    )
                    + (_(", suspect points") if mark.suspects else "")
                    for mark in chosen
                ],
                "hovertemplate": "%{text}<extra></extra>",
                "cliponaxis": False,
            }
        )
    highest = max(
        [mark.value + (mark.uncertainty or 0.0) for mark in marks] + [mark.tolerance or 0.0 for mark in marks]
    )
    return {
        "data": data,
        "layout": framed(
            theme,
            xaxis=date_axis(mark.at for mark in marks),
            yaxis=titled(_("Deviation, µm"), colours, range=[0, max(highest, 1e-6) * 1120], nticks=6),
        ),
    }
