"""Alarm kinds of faults: one that the machine has reported, and a program that touches too often."""

from typing import Literal

from app.core.probing import TouchError
from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.alarms.reading_kinds import cannot_be_stopped
from app.loop.readings.wording import touch_problem
from app.loop.tables.alarms import Alarm

Fault = Literal["battery_low", "receiver", "probe_not_ready", "other"]


def _sentence(alarm: Alarm) -> str:
    text = str(alarm.data.get("text") or "")
    reported = {
        "battery_low": _("The machine reports that the battery of the probe is low."),
        "receiver": _("The machine reports a fault of the probe's receiver: no signal, or a disturbed one."),
        "probe_not_ready": _("The machine reports that the probe is not ready."),
    }.get(str(alarm.data.get("location")), _("The machine reports a fault."))
    return f"{reported} “{text}”" if text else reported


MACHINE_FAULT = register(
    AlarmKind(
        "machine_fault",
        word=lambda: _("Machine fault"),
        sentence=_sentence,
        what_to_do=lambda: _(
            "Change the battery, or look at probe, receiver and cable. The machine ends this alarm when the fault is over."
        ),
        comments={
            "noted": lambda: [_("Battery changed"), _("Receiver cleaned"), _("Cable replaced"), _("Seen")],
        },
        outcomes={"fault_over": lambda _item: _("The machine has reported that the fault is over.")},
    )
)
TOUCH_COUNT = register(
    AlarmKind(
        "touch_count",
        word=lambda: _("Too many touches"),
        sentence=lambda alarm: (
            f"{touch_problem(TouchError(**alarm.data['touch']))} "
            + _("The reading was refused, so nothing is decided about the part.")
            + cannot_be_stopped(alarm)
        ),
        what_to_do=lambda: _("Correct the points or repeats of the characteristic, or the program. Check the parts."),
        tone="stop",
        icon="probe_fault",
        comments={"noted": lambda: [_("Program corrected"), _("Characteristic corrected")]},
    )
)
