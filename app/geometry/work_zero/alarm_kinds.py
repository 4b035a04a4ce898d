"""The alarm kind of a fixture that has shifted."""

from app.geometry.work_zero.wording import shifted
from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register

SHIFTED = register(
    AlarmKind(
        "fixture_shifted",
        word=lambda: _("Fixture shifted"),
        sentence=lambda alarm: shifted(alarm.data),
        what_to_do=lambda: _(
            "Look for chips under the part and at the bolts of the fixture. The next work zero within the limit ends this alarm."
        ),
        comments={
            "noted": lambda: [
                _("Chips under the part"),
                _("Fixture bolted again"),
                _("Vice aligned again"),
            ]
        },
        outcomes={
            "fixture_back": lambda item: _("Work zero {number} is within the limit.").format(number=item.get("number"))
        },
    )
)
