"""An axis in two side views and from above: section centres, how far off they lie, in µm over heights in mm."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.geometry.geometric_form.figures.parts import circle, framed, line, note, rounded_up, titled
from app.language.i18n import _
from app.language.numbers import signed
from app.web.theme import Palette, ThemeName, palette


def axis_figure(
    kind: str,
    details: Mapping[str, Any],
    suspects: Sequence[Mapping[str, Any]],
    tolerance: float | None,
    theme: ThemeName,
) -> dict[str, Any]:
    """Section centres beside the line they are held against, which stands upright in the picture."""
    colours = palette(theme)
    sections = details["sections"]
    offs = [_off(section, sections) for section in sections]
    heights = [section["height"] for section in sections]
    side = None not in heights
    doubted = {suspect["section"] for suspect in suspects}
    reach = _reach(offs, tolerance)
    symbols, tones = _looks(len(sections), doubted, colours)
    data: list[dict[str, Any]] = []
    for axis, name in ((0, "X"), (1, "Y")) if side else ():
        suffix = "" if axis == 0 else "2"
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "x": [off[axis] * 1000 for off in offs],
                "y": heights,
                "xaxis": f"x{suffix}",
                "yaxis": f"y{suffix}",
                "line": {"color": colours.faint, "width": 1.5},
                "marker": {"symbol": symbols, "color": tones, "size": 11},
                "text": [
                    _("section {n}: {axis} {off} µm").format(n=n, axis=name, off=signed(off[axis] * 1000, 1))
                    for n, off in enumerate(offs, start=1)
                ],
                "hovertemplate": "%{text}<extra></extra>",
                "showlegend": False,
                "cliponaxis": False,
            }
        )
        data.append(_upright(heights, suffix, colours, _against(kind) if axis == 0 else None))
    data += _above(offs, symbols, tones, tolerance, colours, "3" if side else "")
    legend_of = [_mark(colours.attention, "x", _("Section with a suspect point"))] if doubted else []
    across = {"range": [-reach * 1000, reach * 1000], "nticks": 5, "tickformat": "+.4~g"}
    wide = titled(_("X off, µm"), colours, **across, domain=[0, 0.24] if side else [0, 1])
    layout = framed(theme, xaxis=wide, yaxis=titled(_("Height Z, mm"), colours))
    if side:
        layout["xaxis2"] = layout["xaxis"] | titled(_("Y off, µm"), colours, domain=[0.33, 0.57], anchor="y2")
        layout["yaxis2"] = layout["yaxis"] | {"matches": "y", "showticklabels": False, "anchor": "x2", "title": None}
        layout["xaxis3"] = layout["xaxis"] | titled(_("from above: X off, µm"), colours, domain=[0.68, 1], anchor="y3")
        layout["yaxis3"] = layout["yaxis"] | titled(_("Y off, µm"), colours, **across, anchor="x3", scaleanchor="x3")
    else:
        layout["yaxis"] |= titled(_("Y off, µm"), colours, **across, scaleanchor="x")
        layout["annotations"] = [
            note(
                _("no heights were stated: from above only"),
                colours,
                x=1,
                xref="paper",
                xanchor="right",
                y=1,
                yref="paper",
            )
        ]
    return {"data": data + legend_of, "layout": layout}


def position_figure(
    details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]], tolerance: float | None, theme: ThemeName
) -> dict[str, Any]:
    """Centres about where they should be, in the tolerance's circle."""
    colours = palette(theme)
    sections = details["sections"]
    offs = [section["off"] for section in sections]
    symbols, tones = _looks(len(sections), {suspect["section"] for suspect in suspects}, colours)
    reach = _reach(offs, tolerance) * 1000
    across = {
        "range": [-reach, reach],
        "nticks": 7,
        "tickformat": "+.4~g",
        "zeroline": True,
        "zerolinecolor": colours.faint,
    }
    return {
        "data": _above(offs, symbols, tones, tolerance, colours, ""),
        "layout": framed(
            theme,
            xaxis=titled(_("X off its place, µm"), colours, **across),
            yaxis=titled(_("Y off its place, µm"), colours, **across, scaleanchor="x"),
        ),
    }


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


def _looks(count: int, doubted: set[Any], colours: Palette) -> tuple[list[str], list[str]]:
    numbers = range(1, count + 1)
    return (
        ["x" if n in doubted else "circle" for n in numbers],
        [colours.attention if n in doubted else colours.steady for n in numbers],
    )


def _against(kind: str) -> str:
    return {"axis_straightness": _("Fitted axis"), "coaxiality": _("Datum axis")}.get(kind, _("Direction of the datum"))


def _upright(heights: Sequence[float], suffix: str, colours: Palette, name: str | None) -> dict[str, Any]:
    low, high = min(heights), max(heights)
    room = 0.06 * ((high - low) or 1.0)
    return line([0, 0], [low - room, high + room], colours.correction, name, xaxis=f"x{suffix}", yaxis=f"y{suffix}")


def _above(
    offs: Sequence[Sequence[float]],
    symbols: list[str],
    tones: list[str],
    tolerance: float | None,
    colours: Palette,
    suffix: str,
) -> list[dict[str, Any]]:
    where: dict[str, Any] = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
    data = []
    if tolerance:
        ring = circle(0, 0, tolerance * 500)
        data.append(line(*ring, colours.quiet, _("Tolerance"), line={"dash": "dash"}, **where))
    farthest = max((off[0] ** 2 + off[1] ** 2) ** 0.5 for off in offs)
    data.append(line(*circle(0, 0, farthest * 1000), colours.faint, _("Deviation found"), line={"width": 1}, **where))
    data.append(
        {
            "type": "scatter",
            "mode": "markers+text",
            "x": [off[0] * 1000 for off in offs],
            "y": [off[1] * 1000 for off in offs],
            "text": [f" {n}" for n in range(1, len(offs) + 1)],
            "textposition": "middle right",
            "textfont": {"size": 12, "color": colours.quiet},
            "marker": {"symbol": symbols, "color": tones, "size": 11},
            "name": _("Section centres"),
            "hovertemplate": "X %{x:+.1f} µm, Y %{y:+.1f} µm<extra></extra>",
            "cliponaxis": False,
        }
        | where
    )
    return data


def _mark(colour: str, symbol: str, name: str) -> dict[str, Any]:
    """A line of the legend alone."""
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [None],
        "y": [None],
        "name": name,
        "marker": {"symbol": symbol, "color": colour, "size": 11},
    }
