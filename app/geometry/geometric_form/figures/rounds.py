"""A section round: its touches about the fitted circle, the deviations magnified, the minimum zone as two circles."""

from collections.abc import Mapping, Sequence
from math import atan2, cos, sin
from typing import Any

from app.charts import Axis, Chart, Dots, Labels, Mark, Note, Panel, Pen, Room, Series, Share
from app.geometry.geometric_form.figures.parts import circle, rounded_up
from app.language.formatting import signed
from app.language.i18n import _

DEEP = 0.32  # of the radius in the picture, that the greatest deviation takes
BESIDE = 0.09  # of the radius: where the number of a touch stands
MOST_NAMES = 72


def round_figure(
    sections_probed: Sequence[Mapping[str, Any]],
    sections: Sequence[Mapping[str, Any]],
    suspects: Sequence[Mapping[str, Any]],
    number: int,
) -> Chart:
    """One section, number from 1; the fitted circle has radius 1 in the picture."""
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
    around = [places[k] for k in (*order, order[0])]
    dashed = Pen("correction", dash="dash")
    outer = circle(shift[0], shift[1], 1 + (ring["outer"] - radius) * deep)
    inner = circle(shift[0], shift[1], 1 + (ring["inner"] - radius) * deep)
    marks: list[Mark] = [
        Series(*circle(0, 0, 1 + k * step * deep), Pen("grid", 1)) for k in (-2, -1, 1, 2) if abs(k) * step * deep < 0.6
    ]
    marks += [
        Series(*circle(0, 0, 1), Pen("quiet"), name=_("Fitted circle")),
        Series(*outer, dashed, name=_("Minimum zone")),
        Series(*inner, dashed),
        Series([x for x, _y in around], [y for _x, y in around], Pen("faint", 1, "dot")),
    ]
    fitting = [k for k in range(len(touches)) if k not in doubted]
    for name, chosen, dots in (
        (_("Probed points"), fitting, Dots("circle")),
        (_("Suspect points"), sorted(doubted), Dots("x", 13, "attention")),
    ):
        if chosen:
            said = [_("point {n}: {off} µm").format(n=k + 1, off=signed(residuals[k] * 1000, 1)) for k in chosen]
            at_x, at_y = [places[k][0] for k in chosen], [places[k][1] for k in chosen]
            marks.append(Series(at_x, at_y, dots=dots, meta=str(dots.symbol), name=name, hover=said))
    if len(touches) <= MOST_NAMES:
        marks.append(
            Series(
                [x + BESIDE * cos(angle) for (x, _y), angle in zip(places, angles, strict=True)],
                [y + BESIDE * sin(angle) for (_x, y), angle in zip(places, angles, strict=True)],
                labels=Labels([str(k + 1) for k in range(len(touches))], "middle center"),
            )
        )
    reach = 1 + DEEP + 2 * BESIDE
    hidden = Axis(hidden=True, reach=(-reach, reach))
    words = _("deviations magnified {times:.0f} ×; from one thin circle to the next {step:g} µm").format(
        times=deep * radius, step=step * 1000
    )
    marks += [
        Note(words, Share(0.5), Share(0), upward="top", shift=(0, -8), size=13),
        Note(_("Section {n}").format(n=at + 1), 0, 0, size=13),
    ]
    return Chart([Panel(marks, hidden, equal=True)], hidden, Room(8, 8, 40, 36))
