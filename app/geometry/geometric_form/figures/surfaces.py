"""A surface as a map of its touches, and a profile: how far above or below the fitted plane or line, in µm."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.charts import Axis, Chart, Colour, Dots, Labels, Panel, Pen, Series, Shades
from app.geometry.geometric_form.figures.parts import ROOM
from app.language.formatting import signed
from app.language.i18n import _

MOST_NAMES = 60


def surface_figure(
    points: Sequence[Sequence[float]], details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]]
) -> Chart:
    """Probed points of a surface, seen from the side to which it faces; shape and number repeat the colour."""
    normal = details["normal"] if "normal" in details else details["feature"]["direction"]
    facing = max(range(3), key=lambda k: abs(normal[k]))
    across = [k for k in range(3) if k != facing]
    residuals = details["residuals"]
    doubted = {suspect["touch"] - 1 for suspect in suspects}
    fitting = [k for k in range(len(points)) if k not in doubted]
    reach = max([abs(residuals[k]) for k in fitting] + [1e-6]) * 1000

    def touches(chosen: list[int], name: str, symbol: str, colour: Colour | None = None, title: str = "") -> Series:
        words = [signed(residuals[k] * 1000, 1) for k in chosen]
        return Series(
            [points[k][across[0]] for k in chosen],
            [points[k][across[1]] for k in chosen],
            dots=Dots(symbol, 16, colour or Shades([residuals[k] * 1000 for k in chosen], reach, title), "quiet", 1),
            labels=Labels(words, "bottom center", "ink") if len(residuals) <= MOST_NAMES else None,
            meta=symbol,
            name=name,
            hover=[_("point {n}: {off} µm").format(n=k + 1, off=word) for k, word in zip(chosen, words, strict=True)],
        )

    marks = [
        touches([k for k in fitting if residuals[k] >= 0], _("Above"), "triangle-up", title="µm"),
        touches([k for k in fitting if residuals[k] < 0], _("Below"), "triangle-down"),
    ]
    if doubted:
        marks.append(touches(sorted(doubted), _("Suspect points"), "x", "stop"))
    x, y = (f"{'XYZ'[k]}, mm" for k in across)
    return Chart([Panel(marks, Axis(y), equal=True)], Axis(x), replace(ROOM, right=90))


def profile_figure(details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]]) -> Chart:
    """Touches along a profile, how far they lie from the fitted line."""
    along, residuals = details["along"], details["residuals"]
    doubted = {suspect["touch"] - 1 for suspect in suspects}
    order = sorted(range(len(along)), key=along.__getitem__)
    ends = [along[order[0]], along[order[-1]]]
    dots = Dots(
        ["x" if k in doubted else "circle" for k in order],
        [13 if k in doubted else 9 for k in order],
        ["attention" if k in doubted else "steady" for k in order],
    )
    marks = [
        Series(ends, [0, 0], Pen("correction"), name=_("Fitted line")),
        *(Series(ends, [height * 1000] * 2, Pen("faint", dash="dash")) for height in (min(residuals), max(residuals))),
        Series(
            [along[k] for k in order],
            [residuals[k] * 1000 for k in order],
            Pen("faint"),
            dots,
            name=_("Probed points"),
            hover=[_("point {n}: {off} µm").format(n=k + 1, off=signed(residuals[k] * 1000, 1)) for k in order],
        ),
    ]
    return Chart([Panel(marks, Axis(_("Off the line, µm"), format="+.4~g"))], Axis(_("Along the profile, mm")), ROOM)
