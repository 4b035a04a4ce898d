"""A section round: its touches about the fitted circle, the deviations magnified, the minimum zone as two circles."""

from collections.abc import Mapping, Sequence
from math import atan2, cos, sin
from typing import Any

from app.geometry.geometric_form.figures.parts import circle, framed, line, note, rounded_up
from app.language.i18n import _
from app.language.numbers import signed
from app.web.theme import ThemeName, palette

DEEP = 0.32  # of the radius in the picture, that the greatest deviation takes
BESIDE = 0.09  # of the radius: where the number of a touch stands
MOST_NAMES = 72


def round_figure(
    sections_probed: Sequence[Mapping[str, Any]],
    sections: Sequence[Mapping[str, Any]],
    suspects: Sequence[Mapping[str, Any]],
    number: int,
    theme: ThemeName,
) -> dict[str, Any]:
    """One section, number from 1; the fitted circle has radius 1 in the picture."""
    colours = palette(theme)
    at = min(number, len(sections)) - 1
    section, touches = sections[at], sections_probed[at]["touches"]
    centre, radius, residuals = section["centre"], section["radius"], section["residuals"]
    ring = section["ring"]
    most = max(*map(abs, residuals), abs(ring["outer"] - radius), abs(radius - ring["inner"]), 1e-6)
    deep = DEEP / most
    shift = [(ring["centre"][k] - centre[k]) * deep for k in (0, 1)]
    doubted = {suspect["touch"] - 1 for suspect in suspects if suspect["section"] == at + 1}
    angles = [atan2(touch[1] - centre[1], touch[0] - centre[0]) for touch in touches]
    places = [
        ((1 + off * deep) * cos(angle), (1 + off * deep) * sin(angle))
        for angle, off in zip(angles, residuals, strict=True)
    ]
    order = sorted(range(len(touches)), key=angles.__getitem__)
    step = rounded_up(most / 2)
    data = [
        line(*circle(0, 0, 1 + k * step * deep), colours.grid, line={"width": 1})
        for k in (-2, -1, 1, 2)
        if abs(k) * step * deep < 0.6
    ]
    data += [
        line(*circle(0, 0, 1), colours.quiet, _("Fitted circle")),
        line(
            *circle(shift[0], shift[1], 1 + (ring["outer"] - radius) * deep),
            colours.correction,
            _("Minimum zone"),
            line={"dash": "dash"},
        ),
        line(
            *circle(shift[0], shift[1], 1 + (ring["inner"] - radius) * deep), colours.correction, line={"dash": "dash"}
        ),
        line(
            [places[k][0] for k in (*order, order[0])],
            [places[k][1] for k in (*order, order[0])],
            colours.faint,
            line={"width": 1, "dash": "dot"},
        ),
    ]
    for name, chosen, symbol, colour, size in (
        (_("Probed points"), [k for k in range(len(touches)) if k not in doubted], "circle", colours.steady, 9),
        (_("Suspect points"), sorted(doubted), "x", colours.attention, 13),
    ):
        if chosen:
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "name": name,
                    "meta": symbol,
                    "x": [places[k][0] for k in chosen],
                    "y": [places[k][1] for k in chosen],
                    "marker": {"symbol": symbol, "size": size, "color": colour},
                    "hovertext": [
                        _("point {n}: {off} µm").format(n=k + 1, off=signed(residuals[k] * 1000, 1)) for k in chosen
                    ],
                    "hovertemplate": "%{hovertext}<extra></extra>",
                    "cliponaxis": False,
                }
            )
    if len(touches) <= MOST_NAMES:
        data.append(
            {
                "type": "scatter",
                "mode": "text",
                "x": [x + BESIDE * cos(angle) for (x, _y), angle in zip(places, angles, strict=True)],
                "y": [y + BESIDE * sin(angle) for (_x, y), angle in zip(places, angles, strict=True)],
                "text": [str(k + 1) for k in range(len(touches))],
                "textfont": {"size": 12, "color": colours.quiet},
                "hoverinfo": "skip",
                "showlegend": False,
            }
        )
    reach = 1 + DEEP + 2 * BESIDE
    hidden = {"visible": False, "range": [-reach, reach]}
    words = _("deviations magnified {times:.0f} ×; from one thin circle to the next {step:g} µm").format(
        times=deep * radius, step=step * 1000
    )
    return {
        "data": data,
        "layout": framed(
            theme,
            xaxis=hidden | {"scaleanchor": "y"},
            yaxis=hidden,
            margin={"l": 8, "r": 8, "t": 36, "b": 40},
            annotations=[
                note(words, colours, x=0.5, xref="paper", y=0, yref="paper", yanchor="top", yshift=-8),
                note(_("Section {n}").format(n=at + 1), colours, x=0, y=0),
            ],
        ),
    }
