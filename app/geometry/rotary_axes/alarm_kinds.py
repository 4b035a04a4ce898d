"""The alarm kind of a rotary axis that has drifted."""

from app.geometry.rotary_axes.wording import alarm_sentence
from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register

DRIFT = register(
    AlarmKind(
        "kinematics_drift",
        word=lambda: _("Rotary axis drifted"),
        sentence=lambda alarm: alarm_sentence(alarm.data),
        what_to_do=lambda: _(
            "Look at the run: enter what it asks for on the control, or look for what has moved. The next run within the limit "
            "ends this alarm."
        ),
        comments={
            "noted": lambda: [
                _("Machine was cold"),
                _("After a collision"),
                _("Calibration sphere clamped again"),
            ]
        },
        outcomes={
            "kinematics_run": lambda item: _(
                "Run {number} of the rotary axes lies within the limit, or was entered on the control."
            ).format(number=item.get("number"))
        },
    )
)
