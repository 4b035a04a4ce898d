"""The two ways in: as history, which is the rule, and live."""

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from app.db.engine import Database
from app.errors import Conflict, Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.readings import queries
from app.loop.readings.importing.cells import MOST_FLAWS, Flaw, Passed
from app.loop.readings.importing.history import Flawed, Progress, Summary, nothing_in, store_history
from app.loop.readings.importing.layout import Layout
from app.loop.readings.importing.lines import Line, Read, lines
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.batch import store_batch
from app.loop.readings.writer.transaction import new_verdicts

MOST_LIVE = 10_000


def import_readings(
    database: Database,
    characteristic: str,
    path: Path,
    layout: Layout,
    *,
    actor: str,
    source: str | None = None,
    live: bool = False,
    dry_run: bool = False,
    progress: Progress = lambda: None,
    read: Read | None = None,
) -> Summary:
    """Import a file, all of it or nothing.

    live: decide as if the readings came in now, with corrections and alarms. dry_run: say what would happen.
    source: what the file is called in the record of changes. read: its lines, where they were read apart. Raises `NotFound`, `Flawed` and `Invalid`.
    """
    with database.sessions() as session:
        entry = queries.entry_named(session, characteristic)
        current = characteristics.characteristic_named(session, characteristic)
        layout = layout if layout.only else layout.of_one(characteristic, current.characteristic.name)
        parsed_lines = lines(path, layout, characteristic) if read is None else read(0, characteristic)
        if not live:
            summary = store_history(
                session, entry, parsed_lines, actor=actor, source=source or path.name, progress=progress
            )
            if dry_run:
                session.rollback()
            else:
                session.commit()
            return summary
    return _store_live(database, entry, parsed_lines, dry_run=dry_run, progress=progress)


def _store_live(
    database: Database, entry: Entry, parsed_lines: Iterable[Line | Flaw | Passed], *, dry_run: bool, progress: Progress
) -> Summary:
    wanted, numbers = _all_good(parsed_lines, progress)
    summary = Summary(lines=len(wanted))
    times = [reading.measured_at or datetime.now(UTC) for reading in wanted]
    summary.first_at, summary.last_at = min(times), max(times)
    if dry_run:
        return summary
    try:
        outcomes = store_batch(database, {}, [(entry, reading) for reading in wanted])
    except (Invalid, Conflict) as refusal:
        if not refusal.errors:
            raise
        raise Flawed(
            [_named(error.field, error.message, numbers) for error in refusal.errors], len(refusal.errors)
        ) from None
    new = new_verdicts(outcomes)
    summary.stored, summary.repeated = len(new), len(outcomes) - len(new)
    for verdict in new:
        zone = verdict.decision.zone.value
        summary.zones[zone] = summary.zones.get(zone, 0) + 1
    summary.corrections = sum(verdict.correction is not None for verdict in new)
    summary.alarms = len({id(alarm) for verdict in new for alarm in verdict.alarms if alarm.new})
    if new:
        summary.first_sequence, summary.last_sequence = new[0].sequence, new[-1].sequence
    return summary


def _all_good(parsed_lines: Iterable[Line | Flaw | Passed], progress: Progress) -> tuple[list[ReadingIn], list[int]]:
    wanted: list[ReadingIn] = []
    numbers: list[int] = []
    passed: dict[str, list[int]] = {}
    flaws: list[Flaw] = []
    wrong = 0
    for line in parsed_lines:
        progress()
        if isinstance(line, Passed):
            passed.setdefault(line.reason, []).append(line.line)
            continue
        if isinstance(line, Flaw):
            wrong += 1
            flaws += [line] if wrong <= MOST_FLAWS else []
            continue
        wanted.append(line.reading)
        numbers.append(line.number)
        if len(wanted) > MOST_LIVE:
            raise Invalid(
                _("Live, at most {most} lines are imported at once.").format(most=MOST_LIVE),
                _("Nothing was imported. This many readings at once are history: import them without --live."),
            )
    if wrong:
        raise Flawed(flaws, wrong)
    if not wanted:
        raise nothing_in(Summary(passed=passed).notes)
    return wanted, numbers


def _named(where: str, message: str, numbers: list[int]) -> Flaw:
    """Return the error of a batch's item `[17].measured` as one of the line that it came from."""
    item, _dot, column = where.partition(".")
    at = item.strip("[]")
    return Flaw(numbers[int(at)] if at.isdigit() and int(at) < len(numbers) else 0, column, "", message)
