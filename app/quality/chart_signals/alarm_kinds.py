"""The alarm kind of run rules on a control chart."""

from collections.abc import Mapping
from typing import Any

from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register
from app.quality.chart_signals.wording import alarm_sentence, page_of


def _chart(characteristic: str, data: Mapping[str, Any]) -> str:
    """The control chart about the last signal of an alarm; empty where it names none."""
    signals = data.get("signals")
    return page_of(characteristic, signals[-1]) if signals else ""


SIGNAL = register(
    AlarmKind(
        "signal",
        word=lambda: _("Signal"),
        sentence=lambda alarm: alarm_sentence(alarm.data) or str(alarm.data.get("text") or _("Signal")),
        what_to_do=lambda: _("Look at the chart and at the parts, then enter the cause. The parts need not be bad."),
        actions=("noted", "tool_replaced"),
        more_actions=lambda alarm: ("false_reading",) if alarm.data.get("readings") else (),
        comments={
            "noted": lambda: [
                _("New batch of material"),
                _("Warmed up"),
                _("Looked for, nothing found"),
            ]
        },
        chart=_chart,
    )
)
