"""An axis in two side views and from above: section centres, how far off they lie, in µm over heights in mm."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.charts import Axis, Chart, Dots, Labels, Mark, Note, Panel, Pen, Series, Share
from app.geometry.geometric_form.figures.parts import ROOM, circle, rounded_up
from app.language.formatting import signed
from app.language.i18n import _


def axis_figure(
    kind: str, details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]], tolerance: float | None
) -> Chart:
    """Section centres beside the line they are held against, which stands upright in the picture."""
    sections = details["sections"]
    offs = [_off(section, sections) for section in sections]
    heights = [section["height"] for section in sections]
    doubted = {suspect["section"] for suspect in suspects}
    reach = _reach(offs, tolerance) * 1000
    dots = _looks(len(sections), doubted)
    above: list[Mark] = [*_above(offs, dots, tolerance)]
    if doubted:  # a line of the legend alone
        suspect = Dots("x", 11, "attention")
        above.append(Series([None], [None], dots=suspect, name=_("Section with a suspect point")))

    def off(title: str) -> Axis:
        return Axis(title, reach=(-reach, reach), ticks=5, format="+.4~g")

    if None in heights:
        words = _("no heights were stated: from above only")
        above.append(Note(words, Share(1), Share(1), "right", size=13))
        return Chart([Panel(above, off(_("Y off, µm")), equal=True)], off(_("X off, µm")), ROOM)
    sides = [_side(axis, offs, heights, dots, _against(kind)) for axis in (0, 1)]
    height = Axis(_("Height Z, mm"))
    return Chart(
        [
            Panel(sides[0], height, x=off(_("X off, µm")), across=(0, 0.24)),
            Panel(sides[1], Axis(labelled=False, matched=True), x=off(_("Y off, µm")), across=(0.33, 0.57)),
            Panel(above, off(_("Y off, µm")), x=off(_("from above: X off, µm")), across=(0.68, 1), equal=True),
        ],
        room=ROOM,
    )


def position_figure(
    details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]], tolerance: float | None
) -> Chart:
    """Centres about where they should be, in the tolerance's circle."""
    sections = details["sections"]
    offs = [section["off"] for section in sections]
    dots = _looks(len(sections), {suspect["section"] for suspect in suspects})
    reach = _reach(offs, tolerance) * 1000
    x, y = (
        Axis(title, reach=(-reach, reach), ticks=7, format="+.4~g", zero="faint")
        for title in (_("X off its place, µm"), _("Y off its place, µm"))
    )
    return Chart([Panel(_above(offs, dots, tolerance), y, equal=True)], x, ROOM)


def _off(section: Mapping[str, Any], sections: Sequence[Mapping[str, Any]]) -> Sequence[float]:
    """Offset of a section's centre; without heights from the mean of all centres."""
    if "off" in section:
        off: Sequence[float] = section["off"]
        return off
    return [section["centre"][k] - sum(other["centre"][k] for other in sections) / len(sections) for k in (0, 1)]


def _reach(offs: Sequence[Sequence[float]], tolerance: float | None) -> float:
    farthest = max([abs(off[k]) for off in offs for k in (0, 1)] + [1e-6])
    if tolerance is not None and tolerance / 2 < 20 * farthest:  # a tolerance far wider would hide what there is
        farthest = max(farthest, tolerance / 2)
    return rounded_up(1.15 * farthest)


def _looks(count: int, doubted: set[Any]) -> Dots:
    numbers = range(1, count + 1)
    return Dots(
        ["x" if n in doubted else "circle" for n in numbers],
        11,
        ["attention" if n in doubted else "steady" for n in numbers],
    )


def _against(kind: str) -> str:
    return {"axis_straightness": _("Fitted axis"), "coaxiality": _("Datum axis")}.get(kind, _("Direction of the datum"))


def _side(
    axis: int, offs: Sequence[Sequence[float]], heights: Sequence[float], dots: Dots, against: str
) -> list[Series]:
    """Seen along the other axis: the centres over their heights, and the line."""
    low, high = min(heights), max(heights)
    room = 0.06 * ((high - low) or 1.0)
    said = [
        _("section {n}: {axis} {off} µm").format(n=n, axis="XY"[axis], off=signed(off[axis] * 1000, 1))
        for n, off in enumerate(offs, start=1)
    ]
    return [
        Series([off[axis] * 1000 for off in offs], heights, Pen("faint"), dots, hover=said),
        Series([0, 0], [low - room, high + room], Pen("correction"), name="" if axis else against),
    ]


def _above(offs: Sequence[Sequence[float]], dots: Dots, tolerance: float | None) -> list[Series]:
    farthest = max((off[0] ** 2 + off[1] ** 2) ** 0.5 for off in offs)
    ring = [Series(*circle(0, 0, tolerance * 500), Pen("quiet", dash="dash"), name=_("Tolerance"))] if tolerance else []
    return [
        *ring,
        Series(*circle(0, 0, farthest * 1000), Pen("faint", 1), name=_("Deviation found")),
        Series(
            [off[0] * 1000 for off in offs],
            [off[1] * 1000 for off in offs],
            dots=dots,
            labels=Labels([f" {n}" for n in range(1, len(offs) + 1)]),
            name=_("Section centres"),
            hover="X %{x:+.1f} µm, Y %{y:+.1f} µm",
        ),
    ]
