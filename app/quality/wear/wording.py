"""The sentences about wear, forecasts and hunting. Lengths in mm."""

from collections.abc import Mapping
from math import floor, inf, log10
from typing import Any

from app.core.forecast import ENOUGH, NO_RECORD, Forecast, Record
from app.core.hunting import GOAL, Hunting, LoopVerdict, Remedy
from app.core.natural_limit import half_width
from app.core.parameters import Parameters
from app.core.wear import FEWEST, Fit, Towards
from app.language.formatting import NO_BREAK_SPACE, grouped, percent, plain_um, signed
from app.language.i18n import _, ngettext

FAR = 10_000  # parts: further ahead nobody plans, and nothing goes on as it is


def per_part(slope: float, decimals: int = 3) -> str:
    r"""Wear in µm per part.

    >>> per_part(0.000061)
    '+0.061\xa0µm'
    """
    return f"{signed(slope * 1000, decimals)}{NO_BREAK_SPACE}µm"


def rounded(parts: float) -> int:
    """Two digits: no more are known.

    >>> rounded(143.2), rounded(7.6), rounded(0)
    (140, 8, 0)
    """
    if parts < 10:
        return round(parts)
    step = 10 ** (floor(log10(parts)) - 1)
    return int(round(parts / step) * step)


def interval(forecast: Forecast) -> str:
    """The interval of a forecast, in parts: `90–260`."""
    high = _("more") if forecast.high == inf or forecast.high > FAR else str(rounded(forecast.high))
    return f"{rounded(forecast.low)}–{high}"


def parts_left(forecast: Forecast) -> str:
    """Number of parts, with the interval: `≈ 140 (90–260)`."""
    if forecast.parts <= 0:
        return _("reached")
    if forecast.parts > FAR:
        return _("more than {n}").format(n=grouped(FAR))
    return f"≈{NO_BREAK_SPACE}{rounded(forecast.parts)} ({interval(forecast)})"


def towards_parts(towards: Towards, *, reached: bool = False) -> str:
    """Coming event, with the number of parts until then."""
    if reached:
        return {
            Towards.WEAR: _("R37 by wear"),
            Towards.TOLERANCE: _("end of the tolerance"),
            Towards.OFFSET: _("offset limit"),
        }[towards]
    return {
        Towards.WEAR: _("parts to R37"),
        Towards.TOLERANCE: _("parts until out of tolerance"),
        Towards.OFFSET: _("parts to limit"),
    }[towards]


def towards_name(towards: Towards) -> str:
    """Coming event, as a heading."""
    return {
        Towards.WEAR: _("Worn by R37"),
        Towards.TOLERANCE: _("End of the tolerance"),
        Towards.OFFSET: _("Offset limit"),
    }[towards]


def definition(towards: Towards, *, corrects: bool) -> str:
    """Definition of the term."""
    if towards is Towards.WEAR:
        return _("a part would deviate by R37 without corrections since tool change")
    if towards is Towards.OFFSET:
        return _("the sum of corrections of this tool reaches its limit, if they follow the wear")
    if corrects:
        return _("a part would be out of tolerance, if nothing were corrected from now on")
    return _("a part is out of tolerance; nothing is corrected here")


def wear_sentence(fit: Fit | None) -> str:
    """Sentence on the wear per part."""
    if fit is None:
        return _("Too few readings of this tool yet: a line needs {n}.").format(n=FEWEST)
    low, high = fit.slope_interval
    if low == high:
        return _("No wear to be seen: the last {n} readings are all the same.").format(n=fit.count)
    if not fit.is_wear:
        return _("No wear to be seen: between {low} and {high} per part over the last {n} readings.").format(
            low=per_part(low), high=per_part(high), n=fit.count
        )
    return _("{slope} per part, between {low} and {high}, over the last {n} readings.").format(
        slope=per_part(fit.slope), low=per_part(low), high=per_part(high), n=fit.count
    )


def fit_note(fit: Fit) -> str:
    """Assumptions behind the numbers."""
    sentences = [
        _("Scatter about the line {scatter} (one standard deviation).").format(scatter=plain_um(fit.scatter, 2))
    ]
    if fit.correlation >= 0.05:
        sentences.append(
            _("Neighbours scatter alike ({rho}): the {n} readings count as {effective}.").format(
                rho=f"{fit.correlation:.2f}", n=fit.count, effective=round(fit.effective)
            )
        )
    if fit.left_out:
        sentences.append(
            ngettext("{n} outlier is left out.", "{n} outliers are left out.", fit.left_out).format(n=fit.left_out)
        )
    return " ".join(sentences)


def held_of(record: Record) -> str:
    """Number of earlier forecasts that held here; says too where none was made yet."""
    if not record.tested:
        return _("No forecast tested here yet: no earlier edge.")
    return ngettext(
        "%(held)s of %(tested)s forecasts held here, on %(lives)s earlier edge.",
        "%(held)s of %(tested)s forecasts held here, on %(lives)s earlier edges.",
        record.lives,
    ) % {"lives": record.lives, "held": record.held, "tested": record.tested}


def about_interval(record: Record) -> str:
    """The meaning of the interval of a forecast, how often earlier ones held, and what it is widened by."""
    meaning = _(
        "In brackets the interval that is meant to hold 95 % of the time. It allows for scatter, for wear that slows down as after a run-in, and for a steep end that may begin with the next part."
    )
    if record.is_enough:
        width = _("It is as wide as these edges needed.")
    else:
        width = _("Until {n} edges are over it is as wide as wear series of other tools need, or wider.").format(
            n=ENOUGH
        )
    return f"{meaning} {held_of(record)} {width}"


def hunting_word(state: LoopVerdict | str) -> str:
    """The verdict in a word or two."""
    return {
        LoopVerdict.UNKNOWN: _("Too few readings"),
        LoopVerdict.QUIET: _("Quiet"),
        LoopVerdict.HUNTING: _("Hunting"),
        LoopVerdict.SWINGING: _("Swinging"),
    }[LoopVerdict(state)]


def hunting_data(hunting: Hunting) -> dict[str, Any]:
    """Values that the sentences are worded from; an alarm keeps them."""
    remedy = hunting.remedy
    return {
        "state": hunting.state.value,
        "readings": hunting.readings,
        "corrections": hunting.corrections,
        "reversals": hunting.reversals,
        "mean_size": hunting.mean_size,
        "scatter": hunting.scatter,
        "expected_corrections": hunting.expected.corrections if hunting.expected else None,
        "expected_reversals": hunting.expected.reversals if hunting.expected else None,
        "expected_size": hunting.expected.size if hunting.expected else None,
        "excess": hunting.expected.excess if hunting.expected else None,
        "remedy": None if remedy is None else remedy._asdict(),
    }


def hunting_sentence(data: Mapping[str, Any]) -> str:
    """Observed over-correction, and the part that scatter alone explains."""
    values = {
        "n": data["readings"],
        "corrections": data["corrections"],
        "reversals": data["reversals"],
        "size": plain_um(data["mean_size"], 1),
        "scatter": plain_um(data["scatter"], 2),
        "alone": _share(data["expected_corrections"]),
        "back": _share(data["expected_reversals"]),
        "excess": _share(data["excess"]),
    }
    match LoopVerdict(data["state"]):
        case LoopVerdict.UNKNOWN:
            return _("Too few readings with these settings yet.")
        case LoopVerdict.QUIET:
            return _(
                "{corrections} corrections in {n} readings, {reversals} reversed the previous one. Scatter of {scatter} alone "
                "would correct {alone} of the readings."
            ).format(**values)
        case LoopVerdict.HUNTING:
            return _(
                "Over-correcting: {reversals} of {corrections} corrections in {n} readings reversed the previous one, "
                "by {size} on average. Scatter of {scatter} alone causes this with these settings; the parts scatter "
                "{excess} more because of it."
            ).format(**values)
        case LoopVerdict.SWINGING:
            return _(
                "The offset swings: {corrections} corrections in {n} readings, {reversals} reversed the previous one, by {size} on "
                "average. Scatter of {scatter} alone would reverse only {back}."
            ).format(**values)


def remedy_sentence(data: Mapping[str, Any], settings: Mapping[str, Any]) -> str:
    """Setting that would quiet the loop, and where to try it. settings: the parameters in force, by name."""
    if data["state"] == LoopVerdict.SWINGING:
        return _(
            "Check the factor of this characteristic, if the machine reports the corrections in effect (correction_in_effect or "
            "machined_at), and if something else changes this offset."
        )
    if data["state"] != LoopVerdict.HUNTING or data["remedy"] is None:
        return ""
    remedy = Remedy(**data["remedy"])
    values = {
        "r33": plain_um(settings["zero_range"], 1),
        "new_r33": plain_um(remedy.zero_range, 1),
        "k": f"{settings['weighting_factor']:g}",
        "new_k": f"{remedy.weighting_factor or 0:g}",
        "r34": plain_um(settings["averaging_limit"], 1),
        "new_r34": plain_um(remedy.averaging_limit, 1),
        "goal": _share(GOAL),
    }
    if remedy.averaging_limit is not None:
        if remedy.averaging_limit > half_width(settings["tolerance_width"], settings.get("natural_limit")):
            return _(
                "No setting helps: the process scatters too much for this tolerance. Average more touches (R27), or find what "
                "makes it scatter."
            )
        text = _("With R34 at {new_r34} instead of {r34} and R33 at {new_r33} instead of {r33}")
    elif remedy.zero_range is not None and remedy.weighting_factor is not None:
        text = _("With R33 at {new_r33} instead of {r33}, or k at {new_k} instead of {k}")
    elif remedy.zero_range is not None:
        text = _("With R33 at {new_r33} instead of {r33} (k alone is not enough)")
    elif remedy.weighting_factor is not None:
        text = _("With k at {new_k} instead of {k} (R33 alone is not enough)")
    else:
        return _("No setting helps: the process scatters too much for these limits.")
    text = (text + _(" scatter alone would correct no more than {goal} of the readings.")).format(**values)
    if remedy.floor and remedy.zero_range == remedy.floor:
        text += " " + _("R33 is not below {floor}, the uncertainty of the probe's signal path.").format(
            floor=plain_um(remedy.floor, 1)
        )
    # The remedy is worked out for scatter alone. A loop that corrects less lets wear and warming up pass as well.
    return f"{text} " + _(
        "These numbers do not show whether it is worth it: a loop that corrects less also lets more wear and warming up pass. "
        "The map on the what-if page simulates these parts with every setting."
    )


def _share(share: float | None) -> str:
    return percent(share, 1 if share is not None and share < 0.095 else 0)


class WearWords:
    """Sentences beside the wear curve on the page of a characteristic."""

    def __init__(
        self,
        fit: Fit | None,
        forecasts: Mapping[Towards, Forecast],
        first: tuple[Towards, Forecast] | None,
        hunting: Hunting | None,
        parameters: Parameters,
        record: Record = NO_RECORD,
    ) -> None:
        self.slope = per_part(fit.slope) if fit is not None and fit.is_wear else None
        self.wear = wear_sentence(fit)
        if fit is not None and fit.off:
            self.wear += " " + _("The newest readings lie far off the line: no forecast.")
        self.note = fit_note(fit) if fit is not None else None
        self.forecasts = [
            (
                towards_name(name),
                parts_left(forecast),
                definition(name, corrects=not parameters.measures_only),
                first is not None and first[0] is name,
            )
            for name, forecast in sorted(forecasts.items(), key=lambda item: item[1].parts)
        ]
        self.held = held_of(record)
        self.about_interval = about_interval(record)
        data = hunting_data(hunting) if hunting is not None else None
        self.hunting = hunting_sentence(data) if data else None
        self.hunting_state = hunting.state.value if hunting else None
        self.hunting_word = hunting_word(hunting.state) if hunting else None
        overcorrects = hunting is not None and hunting.state in (LoopVerdict.HUNTING, LoopVerdict.SWINGING)
        self.hunting_tone = "attention" if overcorrects else "steady"
        self.remedy = remedy_sentence(data, parameters.as_dict()) if data else ""
