"""The decisions on the readings of one characteristic, as its page lists and opens them. Never writes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.context import Chosen
from app.core.decision.limits import within_tolerance
from app.core.decision.step import Code, deviation_of
from app.core.parameters import Parameters
from app.core.probing import Touches, sections_of
from app.errors import NotFound
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.readings import queries as readings
from app.loop.readings.records import Entry
from app.loop.summaries.queries import in_context
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.tools import Correction


class Section(NamedTuple):
    """One section of a part, mm: its corrected size and its deviation; `inside` is on the limit too."""

    size: float
    deviation: float
    inside: bool


@dataclass(frozen=True)
class Decision:
    """One reading with everything that hangs on it, as it is now.

    reading: the answer that it was given (`app.loop.readings.answers`). touches: one list of repeats per point, mm.
    """

    reading: dict[str, Any]
    correction: Correction | None
    alarms: list[Alarm]
    touches: list[list[float | None]] | None

    @property
    def sequence(self) -> int:
        return int(self.reading["sequence"])

    def sections(self, limits: Parameters) -> list[Section]:
        """The sections of a part accepted by n of m, judged as the reading was: with the empirical value of then."""
        if not self.believed or limits.accept_m == 1:
            return []
        empirical_value = self.reading["measured"] - limits.target - self.reading["deviation"]
        deviations = [
            deviation_of(value, limits.target, empirical_value)
            for value in sections_of(limits, [mean for mean in self.point_means if mean is not None])
        ]
        return [
            Section(limits.target + deviation, deviation, within_tolerance(deviation, limits.limits))
            for deviation in deviations
        ]

    @property
    def believed(self) -> bool:
        """Tell if it came as touches and each of them is there and in its window."""
        return bool(self.touches) and self.reading["reason"]["code"] not in {
            Code.TOUCH_FAULT,
            Code.FIRST_MOVE_TRIGGERED,
        }

    @property
    def point_means(self) -> list[float | None]:
        """The mean of the repeats at each point, mm; None where nothing was touched."""
        there = [[touch for touch in point if touch is not None] for point in self.touches or ()]
        return [sum(point) / len(point) if point else None for point in there]


def decisions(
    session: Session,
    current: CurrentCharacteristic,
    *,
    before: int | None = None,
    limit: int = 25,
    context: Chosen = (),
) -> list[Decision]:
    """The decisions before a reading's number (or the last ones), newest first; only on readings of a context, if one is chosen."""
    entry = readings.entry_named(session, current.characteristic.key)
    of_those = [in_context(context)] if context else []
    answers = readings.answers(session, entry, readings.latest(session, entry, before, limit, *of_those))
    return _complete(session, current, entry, readings.with_at_20(session, entry, answers))


def decision(session: Session, current: CurrentCharacteristic, sequence: int) -> Decision:
    """The decision on one reading. Raises `NotFound`."""
    entry = readings.entry_named(session, current.characteristic.key)
    (only,) = _complete(session, current, entry, [readings.detail(session, entry, sequence)])
    return only


def _every_point(touches: Touches | None) -> list[list[float | None]] | None:
    return None if touches is None else [list(point or ()) for point in touches]


def _complete(
    session: Session, current: CurrentCharacteristic, entry: Entry, answers: Sequence[dict[str, Any]]
) -> list[Decision]:
    machine_id = current.machine.id
    numbers = [answer["correction"]["number"] for answer in answers if answer["correction"]]
    corrections: dict[int, Correction] = {}
    if numbers:
        rows = session.scalars(
            select(Correction).where(Correction.machine_id == machine_id, Correction.number.in_(numbers))
        )
        corrections = {row.number: row for row in rows}
    ids = {alarm["id"] for answer in answers for alarm in answer["alarms"]}
    alarms: dict[int, Alarm] = {}
    if ids:
        alarm_rows = session.scalars(select(Alarm).where(Alarm.machine_id == machine_id, Alarm.id.in_(ids)))
        alarms = {row.id: row for row in alarm_rows}
    touches = readings.touches_of(session, entry, [answer["sequence"] for answer in answers])
    return [
        Decision(
            answer,
            corrections.get(answer["correction"]["number"]) if answer["correction"] else None,
            [alarms[alarm["id"]] for alarm in answer["alarms"] if alarm["id"] in alarms],
            _every_point(touches.get(answer["sequence"])),
        )
        for answer in answers
    ]


def version_of(session: Session, current: CurrentCharacteristic, version: int) -> ParametersVersion:
    """The version of the parameters that a reading was judged by. Raises `NotFound`."""
    characteristic = current.characteristic
    row = session.get(ParametersVersion, (characteristic.machine_id, characteristic.id, version))
    if row is None:
        raise NotFound(
            _("Characteristic {key} has no version {version} of its parameters.").format(
                key=characteristic.key, version=version
            ),
            _("The page of the characteristic lists its versions."),
        )
    return row
