"""Alarm kinds about the calibration of a memory location."""

from collections.abc import Mapping
from typing import Any

from app.language.i18n import _, ngettext
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.calibration.wording import refusal


def _location(data: Mapping[str, Any]) -> str:
    """The location of a memory that an alarm is about."""
    if data.get("memory") == "tool":
        return _("offset of the probe, R10 = {location}").format(location=data.get("location"))
    return _("empirical value R11 = {location}").format(location=data.get("location"))


def _passed(data: Mapping[str, Any]) -> str:
    parts, days = data.get("parts"), int(data.get("days") or 0)
    if parts is not None:
        return ngettext("{n} part", "{n} parts", parts).format(n=parts)
    return ngettext("{n} day", "{n} days", days).format(n=days)


def _calibrated(item: Mapping[str, Any]) -> str:
    return _("Calibration {number} was made.").format(number=item.get("number"))


OVERDUE = register(
    AlarmKind(
        "calibration_overdue",
        word=lambda: _("Calibration overdue"),
        sentence=lambda alarm: _("The probe has not been calibrated for {passed}: {place}.").format(
            passed=_passed(alarm.data), place=_location(alarm.data)
        ),
        what_to_do=lambda: _("Calibrate it; that ends this alarm."),
        comments={"noted": lambda: [_("At the end of the batch"), _("At the change of shift")]},
        outcomes={"calibrated": _calibrated},
    )
)
REFUSED = register(
    AlarmKind(
        "calibration_refused",
        word=lambda: _("Calibration refused"),
        sentence=lambda alarm: _("A calibration was refused and changes nothing: {place}. {why}").format(
            place=_location(alarm.data), why=refusal(alarm.data)
        ),
        what_to_do=lambda: _("Clean stylus and gauge and look at the program, then calibrate again."),
        comments={"noted": lambda: [_("Stylus cleaned"), _("Gauge cleaned"), _("Wrong gauge")]},
    )
)
