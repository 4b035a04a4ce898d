"""Bands of the chart: their backgrounds, the limits above and below, and the words at the right."""

from __future__ import annotations

from app.charts import BANDS, Ground, Note, Pen, Role, Rule, Share
from app.core.decision.limits import HasLimits
from app.core.natural_limit import NaturalLimit, half_of, tolerance_about_target
from app.language.formatting import MINUS, NO_BREAK_SPACE, NOTHING, um_limit
from app.language.i18n import _
from app.views.characteristic.figures.scale import Band, Scale, ZoneScale, bands, ends_of

# In the linear scale close limits would write over each other: the least distance as a share of the whole height.
LEAST_DISTANCE = 0.046
TWO_THIRDS = 0.0005  # from ⅔ at most, to be called so: 5.333 µm of 8 µm are
TOLERANCE, LIMIT, TARGET = Pen("ink", 1.75), Pen("faint", 1), Pen("quiet", 1, "4px,4px")


def limit_title(limit: str, limits: HasLimits) -> str:
    """The name of a limit, as everywhere else; of R34 its true share of the half tolerance, which the manual puts at ⅔."""
    return {
        "R33": _("zero range"),
        "R34": _("averaging limit ({share})").format(share=_share(limits)),
        "R35/2": _("tolerance"),
        "R35": _("tolerance"),
        "R37": _("wear limit"),
        "R36": _("confidence limit"),
    }[limit]


def _share(limits: HasLimits) -> str:
    """R34 as a share of R35/2, or of R35 from a natural limit."""
    half = half_of(limits)
    if half <= 0:
        return NOTHING
    share = limits.averaging_limit / half
    return "⅔" if abs(share - 2 / 3) < TWO_THIRDS else f"{share * 100:.3g}{NO_BREAK_SPACE}%"


def band_text(band: Band, sign: int) -> str:
    """Action of the loop in a band, above (+1) or below (-1) the target, with the alarm; the word of the manual's diagram in brackets."""
    return {
        "zero": "<b>" + _("Good") + "</b>, " + _("averaging is stored (zero compensation)"),
        "average": _("averaging and correction"),
        "full": _("corrected in full"),
        "out_of_tolerance": _("corrected in full → Oversize") if sign > 0 else _("corrected in full → Undersize"),
        "wear": _("→ Tool worn (dimensional difference)"),
        "probe_fault": _("→ Probe fault (safe area)"),
    }[band.name]


def band_grounds(limits: HasLimits, ruler: Scale) -> list[Ground]:
    """Backgrounds of the bands: grey inside the tolerance, a light colour outside, and where nothing can be."""
    edge = ruler.position(ruler.natural.side * limits.zero_range)
    end = ruler.natural.side * ruler.beyond
    cannot_be = [Ground(BANDS[0], (0.0, edge)), Ground(BANDS[5], (edge, end))] if ruler.natural.side else []
    return cannot_be + [
        Ground(
            BANDS[band.number],
            (
                sign * _edge(band.lower, ruler),
                sign * (ruler.extent if band.upper is None else _edge(band.upper, ruler)),
            ),
        )
        for band in bands(limits)
        for sign in judged_sides(ruler.natural)
        if _edge(band.lower, ruler) < ruler.extent
    ]


def limit_lines(limits: HasLimits, ruler: Scale) -> list[Rule]:
    """The limits, the tolerance the strongest, and the target, dashed."""
    lines = [Rule(TOLERANCE if ruler.natural.side else TARGET, 0)]
    if ruler.natural.side and limits.zero_range:
        lines.append(Rule(LIMIT, ruler.position(ruler.natural.side * limits.zero_range)))
    for band in bands(limits):
        if not band.limits or not band.lower or not ruler.fits(band.lower):
            continue  # a limit of 0 is the target
        edge = _edge(band.lower, ruler)
        lines += [
            Rule(TOLERANCE if band.begins_outside else LIMIT, sign * edge) for sign in judged_sides(ruler.natural)
        ]
    return lines


def limit_labels(limits: HasLimits, ruler: Scale, size: int, *, brief: bool = False) -> list[Note]:
    """At the right: on each limit its name, value and title; in each band what happens there.

    brief: names and values of the limits only.
    """
    all_bands = bands(limits)
    low, high = ends_of(ruler)
    height = high - low
    middle = [] if isinstance(ruler, ZoneScale) else [_("target")]
    if ruler.natural.side:
        middle = [_("natural limit")]
    if all_bands[0].limits:  # R33 = 0 lies on the target: one label for both sides
        middle.append(f"{' = '.join(all_bands[0].limits)}  0{NO_BREAK_SPACE}µm")
    title = f"  {limit_title(all_bands[0].limits[-1], limits)}" if all_bands[0].limits and not brief else ""
    notes: list[Note] = [_note(0, f"<b>{' = '.join(middle)}</b>{title}" if middle else "", "quiet", size)]
    if ruler.natural.side and not brief:
        strip = (ruler.position(ruler.natural.side * limits.zero_range) + ruler.natural.side * ruler.beyond) / 2
        notes.append(_note(strip, _("cannot be: alarm “probe fault”"), "quiet", size))
    for sign in judged_sides(ruler.natural):
        written = 0.0 if not isinstance(ruler, ZoneScale) else -height
        for band in all_bands:
            lower = _edge(band.lower, ruler)
            if band.limits and band.lower and ruler.fits(band.lower):
                strong = band.begins_outside
                place = max(lower, written + LEAST_DISTANCE * height)
                written = place
                names = " = ".join(band.limits)
                title = "" if brief else f"  {limit_title(band.limits[-1], limits)}"
                ink: Role = "ink" if strong else "quiet"
                notes.append(
                    _note(sign * place, f"<b>{names}  {_signed_limit(sign * band.lower)}</b>{title}", ink, size)
                )
            elif band.limits and band.lower:
                continue
            if brief:
                continue
            upper = ruler.extent if band.upper is None else _edge(band.upper, ruler)
            room = (upper - max(lower, written)) / height
            if isinstance(ruler, ZoneScale):
                if band.number > 0:
                    notes.append(_note(sign * (lower + upper) / 2, band_text(band, sign), "quiet", size, detail=True))
                elif sign > 0 or ruler.natural.side:
                    middle_of = sign * (lower + upper) / 2 if ruler.natural.side else 0
                    notes.append(_note(middle_of, band_text(band, sign), "ink", size))
            elif room > 1.6 * LEAST_DISTANCE and band.number > 0:
                place = max((max(lower, written) + upper) / 2, written + LEAST_DISTANCE * height)
                written = place
                notes.append(_note(sign * place, band_text(band, sign), "quiet", size, detail=True))
    return [note for note in notes if note.text]


def _note(y: float, text: str, colour: Role, size: int, *, detail: bool = False) -> Note:
    return Note(text, Share(1), y, "left", shift=(8, 0), size=size, colour=colour, detail=detail)


def _signed_limit(deviation: float) -> str:
    return um_limit(abs(deviation), MINUS if deviation < 0 else "+")


def size_ticks(limits: HasLimits, ruler: Scale, centre: float | None) -> tuple[list[float], list[str]]:
    """Places and words of the left axis: the sizes (mm) at target and limits, or the deviations if the centre is not known."""
    ticks: list[float] = []
    words: list[str] = []
    low, high = ends_of(ruler)
    least = LEAST_DISTANCE * (high - low)
    sides = judged_sides(ruler.natural)
    for band in bands(limits):
        place = _edge(band.lower, ruler)
        if not ruler.fits(band.lower) or (band.limits and ticks and place - max(map(abs, ticks)) < least):
            continue
        for sign in sides if band.lower else sides[:1]:
            deviation = sign * band.lower
            ticks.append(sign * place)
            text = _signed_limit(deviation) if centre is None else f"{centre + deviation:.4f}"
            words.append(f"<b>{text}</b>" if not band.lower or band.begins_outside else text)
    return ticks, words


def judged_sides(natural: NaturalLimit) -> tuple[int, ...]:
    """Signs of the limits that are judged, the upper one first."""
    return tuple(1 if limit > 0 else -1 for limit in reversed(tolerance_about_target(1.0, natural).judged))


def _edge(deviation: float, ruler: Scale) -> float:
    """The place of a limit; a limit beyond the chart lies at its edge."""
    return ruler.position(deviation) if ruler.fits(deviation) else ruler.extent
