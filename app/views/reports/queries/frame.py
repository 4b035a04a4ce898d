"""Common input of all sections of a report: the characteristic, its readings in the period, what is in force."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import NamedTuple

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.core.parameters import Parameters
from app.core.period import Period
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import History, Numbers, Window
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.readings import Reading
from app.quality.capability.queries import Study, capability_of
from app.views.reports.request import ReportRequest
from app.web.fields import HISTORY_BEGINS

MOST_VERSIONS = 200


class End(NamedTuple):
    """The first or the last reading of a period."""

    sequence: int
    measured_at: datetime
    received_at: datetime
    version: int


@dataclass(frozen=True)
class Frame:
    """One characteristic and one period. `now` is when the report is made."""

    session: Session
    current: CurrentCharacteristic
    request: ReportRequest
    now: datetime

    @property
    def parameters(self) -> Parameters:
        """In force now: the charts of the pages judge by them too."""
        return self.current.parameters

    @cached_property
    def window(self) -> Window:
        """The readings measured in the period."""
        request = self.request
        return statistics.window_of(
            self.session,
            self.current.characteristic,
            last=request.newest,
            period=request.period,
            context=request.context,
            usable=request.last is None,
        )

    @cached_property
    def numbers(self) -> Numbers:
        return statistics.numbers_of(self.session, self.current.characteristic, self.window)

    @cached_property
    def study(self) -> Study:
        """The capability of the readings. Raises `Invalid` for more than ten million."""
        return capability_of(self.session, self.current, self.window, sigma_by=self.request.sigma_by)

    @cached_property
    def history(self) -> History:
        """The deviations of the period and their zones, without excluded ones. Raises `Invalid` for more than ten million."""
        return statistics.history_of(
            self.session, self.current.characteristic, self.window, ("deviation", "zone")
        ).counted

    def holds(self, sequence: InstrumentedAttribute[int] | InstrumentedAttribute[int | None]) -> ColumnElement[bool]:
        """Condition that a row belongs, by its sequence, to a reading of the period."""
        inside = sequence.between(self.window.first, self.window.last)
        if not self.window.narrowed:
            return inside
        return (
            inside
            & select(Reading.sequence)
            .where(
                Reading.machine_id == self.current.machine.id,
                Reading.characteristic_id == self.current.characteristic.id,
                Reading.sequence == sequence,
                self.window.meant,
            )
            .correlate_except(Reading)
            .exists()
        )

    @cached_property
    def ends(self) -> tuple[End, End] | None:
        """The first and the last reading of the window; None without any."""
        if not self.window.count:
            return None
        first, last = (self._end(sequence) for sequence in (self.window.first, self.window.last))
        return first, last

    def _end(self, sequence: int) -> End:
        row = self.session.execute(
            select(Reading.sequence, Reading.measured_at, Reading.received_at, Reading.parameters_version).where(
                Reading.machine_id == self.current.machine.id,
                Reading.characteristic_id == self.current.characteristic.id,
                Reading.sequence == sequence,
            )
        ).one()
        return End(*row)

    @cached_property
    def span(self) -> Period | None:
        """From when to when: the period that was asked for, else that of its readings; None if neither says."""
        start, end = self.request.period
        if self.ends is None:
            return Period(start or HISTORY_BEGINS, end or self.now) if self.request.period.bounded else None
        first, last = self.ends
        of_readings = Period.through(
            min(first.measured_at, first.received_at), self.now if self.window.reaches_now else last.received_at
        )
        return Period(start or of_readings.start, end or of_readings.end)

    @cached_property
    def versions(self) -> Sequence[ParametersVersion]:
        """All versions of the parameters, newest first; of very many the last ones."""
        return characteristics.versions(self.session, self.current.characteristic, limit=MOST_VERSIONS)

    @cached_property
    def versions_used(self) -> list[ParametersVersion]:
        """Those that the readings of the period were judged by, newest first; without readings the one in force."""
        if self.ends is None:
            return [self.current.version]
        low, high = sorted((self.ends[0].version, self.ends[1].version))
        return [parameters_version for parameters_version in self.versions if low <= parameters_version.version <= high]
