"""A surface as a map of its touches, and a profile: how far above or below the fitted plane or line, in µm."""

from collections.abc import Mapping, Sequence
from typing import Any

from app.geometry.geometric_form.figures.parts import framed, line, titled
from app.language.i18n import _
from app.language.numbers import signed
from app.web.theme import Palette, ThemeName, palette


def surface_figure(
    points: Sequence[Sequence[float]],
    details: Mapping[str, Any],
    suspects: Sequence[Mapping[str, Any]],
    theme: ThemeName,
) -> dict[str, Any]:
    """Probed points of a surface, seen from the side to which it faces; shape and number repeat the colour."""
    colours = palette(theme)
    normal = details["normal"] if "normal" in details else details["feature"]["direction"]
    facing = max(range(3), key=lambda k: abs(normal[k]))
    across = [k for k in range(3) if k != facing]
    residuals = details["residuals"]
    doubted = {suspect["touch"] - 1 for suspect in suspects}
    reach = max([abs(off) for k, off in enumerate(residuals) if k not in doubted] + [1e-6]) * 1000
    data = [
        _touches(
            [k for k in range(len(points)) if k not in doubted and (residuals[k] >= 0) is above],
            points,
            across,
            residuals,
            reach,
            colours,
            _("Above") if above else _("Below"),
            "triangle-up" if above else "triangle-down",
        )
        for above in (True, False)
    ]
    if doubted:
        data.append(_touches(sorted(doubted), points, across, residuals, reach, colours, _("Suspect points"), "x"))
    names = [f"{'XYZ'[k]}, mm" for k in across]
    return {
        "data": data,
        "layout": framed(
            theme,
            xaxis=titled(names[0], colours, showline=True),
            yaxis=titled(names[1], colours, scaleanchor="x"),
            margin={"l": 72, "r": 90, "t": 36, "b": 52},
        ),
    }


def _touches(
    chosen: list[int],
    points: Sequence[Sequence[float]],
    across: Sequence[int],
    residuals: Sequence[float],
    reach: float,
    colours: Palette,
    name: str,
    symbol: str,
) -> dict[str, Any]:
    marker: dict[str, Any] = {
        "symbol": symbol,
        "size": 16,
        "color": [residuals[k] * 1000 for k in chosen],
        "cmin": -reach,
        "cmax": reach,
        "colorscale": [[0.0, colours.waiting], [0.5, colours.bands[2]], [1.0, colours.attention]],
        "line": {"width": 1, "color": colours.quiet},
    }
    if symbol == "triangle-up":
        marker["colorbar"] = {"title": {"text": "µm"}, "thickness": 12, "tickformat": "+.3~g", "outlinewidth": 0}
        marker["showscale"] = True
    if symbol == "x":
        marker["color"] = colours.stop
    return {
        "type": "scatter",
        "mode": "markers+text" if len(residuals) <= 60 else "markers",
        "name": name,
        "meta": symbol,
        "x": [points[k][across[0]] for k in chosen],
        "y": [points[k][across[1]] for k in chosen],
        "text": [signed(residuals[k] * 1000, 1) for k in chosen],
        "textposition": "bottom center",
        "textfont": {"size": 12, "color": colours.ink},
        "marker": marker,
        "hovertext": [_("point {n}: {off} µm").format(n=k + 1, off=signed(residuals[k] * 1000, 1)) for k in chosen],
        "hovertemplate": "%{hovertext}<extra></extra>",
        "cliponaxis": False,
    }


def profile_figure(
    details: Mapping[str, Any], suspects: Sequence[Mapping[str, Any]], theme: ThemeName
) -> dict[str, Any]:
    """Touches along a profile, how far they lie from the fitted line."""
    colours = palette(theme)
    along, residuals = details["along"], details["residuals"]
    doubted = {suspect["touch"] - 1 for suspect in suspects}
    order = sorted(range(len(along)), key=along.__getitem__)
    ends = [along[order[0]], along[order[-1]]]
    data = [line(ends, [0, 0], colours.correction, _("Fitted line"))]
    data += [
        line(ends, [height * 1000] * 2, colours.faint, line={"dash": "dash"})
        for height in (min(residuals), max(residuals))
    ]
    data.append(
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": _("Probed points"),
            "x": [along[k] for k in order],
            "y": [residuals[k] * 1000 for k in order],
            "line": {"color": colours.faint, "width": 1.5},
            "marker": {
                "symbol": ["x" if k in doubted else "circle" for k in order],
                "color": [colours.attention if k in doubted else colours.steady for k in order],
                "size": [13 if k in doubted else 9 for k in order],
            },
            "hovertext": [_("point {n}: {off} µm").format(n=k + 1, off=signed(residuals[k] * 1000, 1)) for k in order],
            "hovertemplate": "%{hovertext}<extra></extra>",
            "cliponaxis": False,
        }
    )
    return {
        "data": data,
        "layout": framed(
            theme,
            xaxis=titled(_("Along the profile, mm"), colours),
            yaxis=titled(_("Off the line, µm"), colours, tickformat="+.4~g"),
        ),
    }
