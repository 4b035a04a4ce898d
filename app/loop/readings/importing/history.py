"""The past: a file's readings judged in the order of its lines, staged beside the table, then numbered and stored at once.

However long the file is, it is one transaction and flat memory: lines stream into a temporary table while no lock is held,
so that the machine goes on; the lock is taken only to number them and copy them over. Killed in the middle, nothing of it
was ever there.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

import msgspec
from psycopg import Connection, Cursor, RawCursor
from sqlalchemy.orm import Session

from app.access.audit import actions as audit
from app.core.decision.decide import LoopState, decide
from app.core.decision.limits import Zone
from app.core.decision.step import Code, deviation_of
from app.core.parameters import Mode, Parameters
from app.core.probing import TouchError, measured_value
from app.core.variants import Results, results_of
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.files.formats.repeats import lines_of
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines import queries as machines
from app.loop.readings.importing.cells import MOST_FLAWS, Flaw, Passed
from app.loop.readings.importing.lines import Line
from app.loop.readings.origin import SAME
from app.loop.readings.records import Entry
from app.loop.readings.wording import touch_problem
from app.loop.readings.writer.save import full_blocks
from app.loop.readings.writer.statements import as_json
from app.loop.tables.tools import AverageMemory

Progress = Callable[[], None]
NAMED_LINES = 4

STAGE = """
CREATE TEMPORARY TABLE staged (line bigint, key text, measured float8, deviation float8, average_before float8,
    average_after float8, measured_at timestamptz, machined_at timestamptz, zone text, part text, touches jsonb, results jsonb,
    context jsonb, origin bigint, origin_at timestamptz, origin_measured float8
) ON COMMIT DROP
"""
COPY = """
COPY staged (line, key, measured, deviation, average_before, average_after, measured_at, machined_at, zone, part, touches,
    results, context, origin, origin_at, origin_measured)
FROM STDIN
"""
# What Inband wrote itself, by number and moment of arrival, and there with another size.
_OURS = """
r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.sequence = s.origin AND r.received_at = s.origin_at
"""
CHANGED = f"""
SELECT s.line, s.key, s.origin_measured, r.measured, r.sequence, NULL::bigint FROM staged s
JOIN reading r ON {_OURS} WHERE abs(r.measured - s.origin_measured) >= {SAME} ORDER BY 1 LIMIT %(most)s
"""  # noqa: S608 - made of our own texts
FORGET_OURS = f"DELETE FROM staged s USING reading r WHERE {_OURS}"  # noqa: S608
# The same key with another value, in the record or further up in the file.
CLASHES = """
SELECT s.line, s.key, s.measured, r.measured, r.sequence, NULL::bigint FROM staged s
JOIN reading r ON r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.key = s.key
WHERE abs(r.measured - s.measured) >= 5e-10
UNION ALL
SELECT line, key, measured, first, NULL, first_line FROM (
    SELECT line, key, measured, first_value(measured) OVER w AS first, first_value(line) OVER w AS first_line
    FROM staged WINDOW w AS (PARTITION BY key ORDER BY line)
) t WHERE abs(measured - first) >= 5e-10
ORDER BY 1 LIMIT %(most)s
"""
FORGET_STORED = """
DELETE FROM staged s USING reading r
WHERE r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.key = s.key
"""
FORGET_REPEATED = """
DELETE FROM staged s USING (SELECT key, min(line) AS line FROM staged GROUP BY key HAVING count(*) > 1) f
WHERE s.key = f.key AND s.line > f.line
"""
NUMBER = """
INSERT INTO reading (machine_id, characteristic_id, sequence, measured, deviation, decided, average_before, average_after,
    measured_at, received_at, machined_at, parameters_version, late, zone, action, code, key, part)
SELECT %(machine)s, %(characteristic)s, %(sequence)s + row_number() OVER earlier, measured, deviation, deviation,
    average_before, average_after, measured_at, %(now)s, machined_at, %(version)s,
    coalesce(measured_at < greatest(%(last)s, max(measured_at) OVER earlier), false), zone, 'none', %(code)s, key, part
FROM staged WINDOW earlier AS (ORDER BY line)
"""
TOUCHES = """
INSERT INTO reading_touches (machine_id, characteristic_id, sequence, touches)
SELECT r.machine_id, r.characteristic_id, r.sequence, s.touches FROM staged s
JOIN reading r ON r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.key = s.key
WHERE s.touches IS NOT NULL
"""
CONTEXT = """
INSERT INTO reading_context (machine_id, characteristic_id, sequence, context)
SELECT r.machine_id, r.characteristic_id, r.sequence, s.context FROM staged s
JOIN reading r ON r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.key = s.key
WHERE s.context IS NOT NULL
"""
RESULTS = f"""
INSERT INTO reading_results (machine_id, characteristic_id, sequence, {", ".join(Results._fields)})
SELECT r.machine_id, r.characteristic_id, r.sequence, {", ".join(f"f.{name}" for name in Results._fields)} FROM staged s
JOIN reading r ON r.machine_id = %(machine)s AND r.characteristic_id = %(characteristic)s AND r.key = s.key
CROSS JOIN LATERAL jsonb_populate_record(NULL::reading_results, s.results) f
WHERE s.results IS NOT NULL
"""  # noqa: S608 - made of the names of our columns
# What the plant page shows as the last reading is the newest one, not the one that arrived last. Parts of the past were
# not cut by the tool that is in the machine now: its count of parts stays.
MOVE_STREAM = """
UPDATE stream t SET sequence = t.sequence + %(count)s, sequence_at_tool_change = t.sequence_at_tool_change + %(count)s,
    last_average = coalesce(t.last_average, 0),
    last_measured_at = greatest(t.last_measured_at, least(n.measured_at, %(now)s)),
    last_measured = CASE WHEN newer THEN n.measured ELSE t.last_measured END,
    last_deviation = CASE WHEN newer THEN n.deviation ELSE t.last_deviation END,
    last_zone = CASE WHEN newer THEN n.zone ELSE t.last_zone END,
    last_received_at = CASE WHEN newer THEN %(now)s ELSE t.last_received_at END
FROM (
    SELECT s.*, coalesce(s.measured_at >= t.last_measured_at, true) AS newer FROM staged s, stream t
    WHERE t.machine_id = %(machine)s AND t.characteristic_id = %(characteristic)s
    ORDER BY s.measured_at DESC, s.line DESC LIMIT 1
) n
WHERE t.machine_id = %(machine)s AND t.characteristic_id = %(characteristic)s
"""


class Flawed(Invalid):
    """Lines of the file cannot be taken; `flaws` are the first of them, `count` all."""

    def __init__(self, flaws: list[Flaw], count: int) -> None:
        super().__init__(
            _("{count} things are wrong with the file.").format(count=count)
            if count != 1
            else _("One thing is wrong with the file."),
            _("Nothing was imported. Correct the lines that are named and import the file again."),
            errors=[FieldError(f"line {f.line}" + (f", {f.column}" if f.column else ""), f.reason) for f in flaws],
        )
        self.flaws = flaws
        self.count = count


@dataclass
class Summary:
    """The result of an import, or of one that is only tried."""

    lines: int = 0
    stored: int = 0
    repeated: int = 0
    corrections: int = 0
    alarms: int = 0
    zones: dict[str, int] = field(default_factory=dict)
    first: tuple[int, float] = (0, 0.0)  # line and size of the first reading
    first_at: datetime | None = None
    last_at: datetime | None = None
    untimed: list[int] = field(default_factory=list)  # lines without a time, the first of them
    untimed_count: int = 0
    before_times: list[int] = field(default_factory=list)  # the same, above the first line with a time
    before_times_count: int = 0
    first_sequence: int | None = None
    last_sequence: int | None = None
    passed: dict[str, list[int]] = field(default_factory=dict)
    has_form: bool = False  # among the results of its touches
    without_form: list[str] = field(default_factory=list)  # characteristics of form that get no readings of it

    def begin_times(self) -> None:
        """The first line with a time: those above it take its time, which is known only now."""
        self.before_times, self.before_times_count = self.untimed, self.untimed_count
        self.untimed, self.untimed_count, self.first_at, self.last_at = [], 0, None, None

    @property
    def notes(self) -> list[str]:
        """Sentences on lines that were passed over, and on those without a time; of a file without any the layout says so."""
        texts = [
            _("{lines}: {reason}; passed over.").format(lines=lines_of(each), reason=why)
            for why, each in self.passed.items()
        ]
        if self.before_times_count:
            named = lines_of(self.before_times, self.before_times_count)
            texts.append(_("{lines}: no time; it is that of the first line below that has one.").format(lines=named))
        if 0 < self.untimed_count < self.lines:
            named = lines_of(self.untimed, self.untimed_count)
            texts.append(_("{lines}: no time; it is that of the line above.").format(lines=named))
        if self.has_form and self.without_form:
            words = _(
                "Form is stored with each reading as a result of its touches; the characteristics of form ({keys}) get no readings "
                "from an imported file."
            )
            texts.append(words.format(keys=", ".join(self.without_form)))
        return texts


@dataclass
class _Judge:
    """Judges the past with a running average of its own, which begins at 0."""

    parameters: Parameters
    empirical_value: float
    now: datetime
    average: float = 0.0
    time_above: datetime | None = None  # of the newest line that has one: also that of lines below it that have none

    def row(self, line: Line) -> tuple[Any, ...] | Flaw:
        reading, parameters = line.reading, self.parameters
        measured, results = float(reading.measured or 0.0), None
        empirical_value = 0.0 if reading.is_by_hand else self.empirical_value
        if reading.touches is not None:
            try:
                measured, points, fault = measured_value(parameters, reading.touches)
                if fault is not None:
                    raise fault
                results = results_of(parameters, reading.touches, points, empirical_value)
            except TouchError as error:
                return Flaw(line.number, "touches", "", touch_problem(error))
        decision = decide(
            parameters,
            LoopState(self.average),
            deviation_of(measured, parameters.target, empirical_value),
            accepted=results is None or not results.rejected,
        )
        self.average = decision.average_after
        self.time_above = reading.measured_at or self.time_above
        return (
            line.number,
            reading.key,
            measured,
            decision.deviation,
            decision.average_before,
            decision.average_after,
            reading.measured_at or self.time_above or self.now,
            reading.machined_at,
            decision.zone.value,
            reading.part,
            None if reading.touches is None else msgspec.json.encode(reading.touches).decode(),
            None if results is None else msgspec.json.encode(results._asdict()).decode(),
            None if reading.context is None else msgspec.json.encode(reading.context).decode(),
            *(line.origin or (None, None, None)),
        )


def store_history(
    session: Session,
    entry: Entry,
    lines: Iterable[Line | Flaw | Passed],
    *,
    actor: str,
    source: str,
    progress: Progress,
) -> Summary:
    """Judge and store them; the caller commits, or looks only and rolls back.

    Raises `Flawed` naming the lines that cannot be taken, `Invalid` when the whole file is of something else, and
    `Conflict` when the parameters change meanwhile.
    """
    current = characteristics.characteristic_named(session, entry.characteristic)
    judge = _judge(session, current)
    conn = _driver(session)
    with conn.cursor() as cursor:
        cursor.execute("SET LOCAL statement_timeout = 0; SET LOCAL idle_in_transaction_session_timeout = 0")
        cursor.execute(STAGE)
        summary = _stage(cursor, lines, judge, progress)
        _refuse_something_else(summary, judge.parameters)
        cursor.execute("ANALYZE staged")
        machines.lock_machines(session, [entry.machine_id])
        session.expire_all()
        now = characteristics.characteristic_named(session, entry.characteristic)
        _refuse_change(current, now)
        _refuse_new_empirical_value(judge.empirical_value, _empirical_value(session, now))
        summary.without_form = [form.characteristic.key for form in characteristics.forms(session, now.characteristic)]
        _move_over(cursor, entry, current.version.version, judge.now, summary)
        cursor.execute("DROP TABLE staged")  # a wide sheet stages one characteristic after the other
    if summary.stored:
        counted = {"file": source, "readings": summary.stored, "first": summary.first_sequence}
        audit.record(session, actor, "readings imported", f"characteristic/{entry.characteristic}", None, counted)
        publish(session, entry.changed(summary.last_sequence))
    return summary


def _judge(session: Session, current: CurrentCharacteristic) -> _Judge:
    parameters = replace(current.parameters, mode=Mode.MEASURE_ONLY)
    return _Judge(parameters, _empirical_value(session, current), datetime.now(UTC))


def _empirical_value(session: Session, current: CurrentCharacteristic) -> float:
    location = current.parameters.average_memory
    if not location:
        return 0.0
    return session.get_one(AverageMemory, (current.machine.id, location), populate_existing=True).empirical_value


def _driver(session: Session) -> Connection[Any]:
    conn = session.connection().connection.driver_connection
    assert isinstance(conn, Connection)
    return conn


def _stage(cursor: Cursor[Any], lines: Iterable[Line | Flaw | Passed], judge: _Judge, progress: Progress) -> Summary:
    summary = Summary()
    flaws: list[Flaw] = []
    wrong, dated = 0, None  # the first line with a time
    with cursor.copy(COPY) as copy:
        for line in lines:
            progress()
            if isinstance(line, Passed):
                summary.passed.setdefault(line.reason, []).append(line.line)
                continue
            row = judge.row(line) if isinstance(line, Line) else line
            if isinstance(row, Flaw):
                wrong += 1
                if wrong <= MOST_FLAWS:
                    flaws.append(row)
                continue
            if wrong:
                continue
            copy.write_row(row)
            if dated is None and judge.time_above is not None:
                dated = row
                summary.begin_times()
            _count(summary, row)
            summary.has_form = summary.has_form or row[11] is not None
            if isinstance(line, Line) and line.reading.measured_at is None:
                summary.untimed_count += 1
                summary.untimed += [line.number] if len(summary.untimed) < NAMED_LINES else []
        if wrong:
            raise Flawed(flaws, wrong)
    if dated is not None and summary.before_times_count:
        cursor.execute("UPDATE staged SET measured_at = %s WHERE line < %s", (dated[6], dated[0]))
    if not summary.lines:
        raise nothing_in(summary.notes)
    return summary


def nothing_in(notes: Sequence[str]) -> Invalid:
    """The refusal of a file without a reading. notes: on the lines that were passed over."""
    if notes:
        return Invalid(
            _("The file holds no readings: {notes}").format(notes=" ".join(notes)), _("Nothing was imported.")
        )
    return Invalid(_("The file holds no readings: there is nothing after its header."), _("Nothing was imported."))


def _count(summary: Summary, row: tuple[Any, ...]) -> None:
    if not summary.lines:
        summary.first = row[0], row[2]
    summary.lines += 1
    measured_at, zone = row[6], row[8]
    summary.zones[zone] = summary.zones.get(zone, 0) + 1
    summary.first_at = min(summary.first_at or measured_at, measured_at)
    summary.last_at = max(summary.last_at or measured_at, measured_at)


def _refuse_something_else(summary: Summary, parameters: Parameters) -> None:
    """Refuse a file of which no value can be one: that is no fault of a probe, but another column, unit or characteristic."""
    if summary.zones.get(Zone.PROBE_FAULT.value, 0) < summary.lines:
        return
    line, size = summary.first
    words = _(
        "Every value lies more than {limit:g} mm (R36) from the target {target:g} mm, the first one in line {line} with {size:g} mm."
    )
    question = _(
        "Nothing was imported. Is it the right characteristic and the right column? If the values are not in mm, name their unit."
    )
    reason = _("no value is near the target")
    if abs(deviation_of(size, parameters.target, 0.0)) <= parameters.confidence_limit:
        words = _(
            "Every value lies beyond the natural limit {target:g} mm, which no part can pass, the first one in line {line} with {size:g} mm."
        )
        question = _(
            "Nothing was imported. Is it the right characteristic, column and sign? A limit that parts can pass is no natural one: "
            "correct it in the parameters."
        )
        reason = _("no value is on this side of the natural limit")
    raise Invalid(
        words.format(limit=parameters.confidence_limit, target=parameters.target, line=line, size=size),
        question,
        errors=[FieldError(_("line {line}").format(line=line) + ", measured", reason)],
    )


def _refuse_change(then: CurrentCharacteristic, now: CurrentCharacteristic) -> None:
    if then.version.version != now.version.version:
        raise Conflict(
            _("{who} has changed the parameters of this characteristic while the file was read.").format(
                who=now.version.created_by
            ),
            _("Nothing was imported. Import the file again, so that it is judged by the new ones."),
        )


def _refuse_new_empirical_value(then: float, now: float) -> None:
    if then != now:
        raise Conflict(
            _("The empirical value was changed from {then:+.1f} µm to {now:+.1f} µm while the file was read.").format(
                then=then * 1000, now=now * 1000
            ),
            _("Nothing was imported. Import the file again, so that it is judged by the new one."),
        )


def _move_over(cursor: Cursor[Any], entry: Entry, version: int, now: datetime, summary: Summary) -> None:
    """Under the machine's lock: out with what is there already, then number and store the rest."""
    where: dict[str, Any] = {"machine": entry.machine_id, "characteristic": entry.characteristic_id}
    for statement, forget in ((CHANGED, FORGET_OURS), (CLASHES, FORGET_STORED)):
        if clashes := cursor.execute(statement, where | {"most": MOST_FLAWS}).fetchall():
            raise Flawed([_clash(*row) for row in clashes], len(clashes))
        cursor.execute(forget, where)
    cursor.execute(FORGET_REPEATED)
    found = cursor.execute(
        "SELECT sequence, last_measured_at FROM stream WHERE machine_id = %(machine)s"
        " AND characteristic_id = %(characteristic)s",
        where,
    ).fetchone()
    assert found is not None
    before, last = found
    values = where | {"sequence": before, "last": last, "now": now, "version": version, "code": Code.IMPORTED.value}
    summary.stored = cursor.execute(NUMBER, values).rowcount
    summary.repeated = summary.lines - summary.stored
    if not summary.stored:
        return
    summary.first_sequence, summary.last_sequence = before + 1, before + summary.stored
    cursor.execute(TOUCHES, where)
    cursor.execute(RESULTS, where)
    cursor.execute(CONTEXT, where)
    cursor.execute(MOVE_STREAM, where | {"count": summary.stored, "now": now})
    for statement, rows in full_blocks([(entry, before, summary.last_sequence)]):
        RawCursor(cursor.connection).execute(statement, (as_json(rows),))


def _clash(line: int, key: str, measured: float, other: float, sequence: int | None, first: int | None) -> Flaw:
    known = _("reading {number}").format(number=sequence) if first is None else _("line {line}").format(line=first)
    reason = _("belongs to {known}, which measured {other} mm, not {measured} mm").format(
        known=known, other=other, measured=measured
    )
    return Flaw(line, "key", key, reason)
