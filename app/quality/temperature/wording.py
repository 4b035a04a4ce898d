"""Sentences about drift by temperature. Lengths in mm."""

from app.core.drift import Column, Drift
from app.core.regression import INFLATED, Effect, LeftOut
from app.core.spc.refusal import Reason, Refused
from app.core.temperature import HIGHEST, LOWEST
from app.language.formatting import NO_BREAK_SPACE, fixed, percent, plain_um, short, signed
from app.language.i18n import _, ngettext
from app.loop.summaries.wording import refusal
from app.quality.temperature.queries import Study


def column_name(column: str, of: str) -> str:
    """The name of an effect. of: whose temperature."""
    return {
        Column.TEMPERATURE: _("Temperature of the part") if of == "part" else _("Temperature of the machine"),
        Column.SINCE_PAUSE: _("Warming up after a pause"),
        Column.WEAR: _("Wear"),
    }[Column(column)]


def per(value: float, column: str) -> str:
    r"""An effect in µm with its unit.

    >>> per(0.00046, "temperature"), per(-0.0000123, "wear")
    ('+0.46\xa0µm/K', '−0.0123\xa0µm/part')
    """
    if column == Column.TEMPERATURE:
        return f"{signed(value * 1000, 2)}{NO_BREAK_SPACE}µm/K"
    part = _("part")
    return f"{signed(value * 1000, 4)}{NO_BREAK_SPACE}µm/{part}"


def left_out(why: LeftOut) -> str:
    """The reason why an effect cannot be separated."""
    return {
        LeftOut.CONSTANT: _("does not vary in these readings"),
        LeftOut.DETERMINED: _("moves with the others exactly: it cannot be separated from them"),
    }[why]


def too_few(refused: Refused) -> str:
    """The reason why there is no result."""
    if refused.reason is Reason.TOO_FEW_READINGS:
        return ngettext(
            "%(num)s reading has a temperature that is believed; %(needed)s are needed.",
            "%(num)s readings have a temperature that is believed; %(needed)s are needed.",
            refused.have,
        ) % {"num": refused.have, "needed": refused.needed}
    return refusal(refused)


def unknown(count: int) -> str:
    """The number of readings that are left out because their corrections are not known."""
    return ngettext(
        "%(num)s reading is left out: it is not known with which corrections its part was cut.",
        "%(num)s readings are left out: it is not known with which corrections their parts were cut.",
        count,
    ) % {"num": count}


def sentences(study: Study, drift: Drift) -> list[str]:
    """The result, and how far it can be trusted."""
    found = drift.regression
    effect = found.effects.get(Column.TEMPERATURE.value)
    said = [_slope(effect)] if effect is not None else []
    if study.expected is not None:
        said.append(_expected(study, effect))
    said.append(
        _(
            "Temperature, warming up and wear together explain {share} of the variation; {scatter} remains (one standard deviation)."
        ).format(share=percent(found.r_squared), scatter=plain_um(found.scatter, 2))
    )
    said += _doubts(study, drift)
    return said


def _slope(effect: Effect) -> str:
    values = {
        "value": per(effect.value, Column.TEMPERATURE),
        "low": per(effect.low, Column.TEMPERATURE),
        "high": per(effect.high, Column.TEMPERATURE),
        "share": percent(effect.share),
    }
    if not effect.significant:
        return _("No effect of the temperature to be seen: between {low} and {high}.").format(**values)
    return _(
        "{value}, between {low} and {high} (95 %), while warming up and wear stay; by itself it explains {share} of the variation."
    ).format(**values)


def _expected(study: Study, effect: Effect | None) -> str:
    expected = study.expected or 0.0
    said = (
        _("The part alone would expand by {value}.") if study.of == "part" else _("The scale alone would show {value}.")
    ).format(value=per(expected, Column.TEMPERATURE))
    if effect is None or effect.low <= expected <= effect.high:
        return said
    return f"{said} " + _("The rest comes from the machine, or from something that changes with the temperature.")


def _doubts(study: Study, drift: Drift) -> list[str]:
    found = drift.regression
    said = []
    if any(effect.inflated for effect in found.effects.values()):
        names = ", ".join(column_name(name, study.of) for name, effect in found.effects.items() if effect.inflated)
        said.append(
            _("Hard to tell apart, for they change together (variance inflation above {most}): {names}.").format(
                most=short(INFLATED), names=names
            )
        )
    if found.correlation >= 0.05:
        said.append(
            _("Neighbours scatter alike ({rho}): the {n} readings count as {effective}.").format(
                rho=fixed(found.correlation, 2), n=found.readings, effective=round(found.effective)
            )
        )
    if study.readings > study.stated:
        said.append(
            ngettext(
                "%(num)s reading has no temperature.",
                "%(num)s readings have no temperature.",
                study.readings - study.stated,
            )
            % {"num": study.readings - study.stated}
        )
    if drift.unbelieved:
        said.append(
            ngettext(
                "%(num)s temperature cannot be true (believed: %(low)s to %(high)s °C) and is left out: check the sensor.",
                "%(num)s temperatures cannot be true (believed: %(low)s to %(high)s °C) and are left out: check the sensor.",
                drift.unbelieved,
            )
            % {"num": drift.unbelieved, "low": short(LOWEST), "high": short(HIGHEST)}
        )
    if study.worn:
        said.append(
            ngettext(
                "%(num)s reading of a worn or broken tool is left out.",
                "%(num)s readings of worn or broken tools are left out.",
                study.worn,
            )
            % {"num": study.worn}
        )
    if study.unknown:
        said.append(unknown(study.unknown))
    if not study.rebuilt:
        said.append(_("It is not known which corrections these parts were cut with: sizes are taken as they came out."))
    said.append(_("What changes together need not be cause and effect."))
    return said
