"""The measuring sheet: sizes of one part that a person types, as readings of the same door and decision as the machine's.

A sheet has a key of its own. All readings of it are stored together or none, and sent twice they are stored once.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.context import ContextField
from app.core.number_text import NotANumber, NumberFault, plain, read_number
from app.core.parameters import LARGEST_LENGTH, Parameters, Variant
from app.core.plausibility import is_doubtful, looks_like_inches
from app.db.engine import Database
from app.errors import FieldError, Invalid
from app.language.formatting import short, um_limit
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.readings import queries as readings
from app.loop.readings.records import Entry
from app.loop.readings.schemas import Context, ReadingIn, clean_text
from app.loop.readings.writer.batch import store_batch
from app.loop.readings.writer.group_commit import Writer
from app.loop.readings.writer.pending import Stored
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Reading, ReadingContext
from app.loop.tables.tools import Correction

MOST_LINES = 60
"""Characteristics of one sheet, in the order in which the drawing's were set up."""
MOST_CORRECTIONS = 4
LOOKED_BACK = timedelta(days=1)
"""A correction that took effect within this time may be younger than the part in the hand."""
MUST_BE_SAID = timedelta(hours=1)
"""One that took effect within this time makes the question needed."""
LATEST = "now"
"""Answer to the question: the part was cut with the offset as it is."""
LONGEST_TEXT = 128
SCANNED = tuple(field for field in ContextField if field is not ContextField.OPERATOR)
"""Fields of the context that the sheet asks for; the operator is the person who stores it."""
_KEY = re.compile(r"[0-9a-f]{16}", re.ASCII)


NONE_REQUIRED: Mapping[str, tuple[ContextField, ...]] = {}


class SheetLine(NamedTuple):
    """A characteristic on the sheet. sections: the number of sizes that it takes; 0: touches of a probe are needed."""

    entry: Entry
    name: str
    drawing: str | None
    parameters: Parameters
    sections: int

    @property
    def fields(self) -> list[str]:
        """Names of its fields in the form."""
        key = self.entry.characteristic
        return [f"size:{key}"] if self.sections == 1 else [f"size:{key}:{n}" for n in range(1, self.sections + 1)]


class Sheet(NamedTuple):
    """The lines of one drawing, the drawings to choose from, and the corrections that a part may be older than."""

    lines: list[SheetLine]
    drawings: list[str]
    drawing: str | None
    recent: Sequence[Correction]
    must_say: bool


@dataclass(frozen=True)
class Filled:
    """A sheet as it was typed: readings to store, and questions by field about sizes that are more likely slips."""

    readings: list[tuple[Entry, ReadingIn]]
    questions: dict[str, str] = field(default_factory=dict)


def sheet_of(session: Session, machine: Machine, drawing: str | None = None, only: str | None = None) -> Sheet:
    """The sheet of a machine: of one drawing, of the first without a name, or of one characteristic."""
    rows = characteristics.characteristics(session, machine_id=machine.id)
    lines = [
        SheetLine(
            Entry(machine.id, machine.key, row.characteristic.id, row.characteristic.key),
            row.characteristic.name,
            row.characteristic.part,
            row.parameters,
            sections_of(row.parameters),
        )
        for row in sorted(rows, key=lambda row: row.characteristic.id)
        if row.source is None  # a form is a result of another one's touches
    ]
    drawings = list(dict.fromkeys(line.drawing or "" for line in lines))
    here = next((line.drawing or "" for line in lines if line.entry.characteristic == only), None)
    chosen = here if here is not None else drawing if drawing in drawings else next(iter(drawings), None)
    shown = [
        line for line in lines if (line.drawing or "") == chosen and (here is None or line.entry.characteristic == only)
    ]
    now = datetime.now(UTC)
    recent = session.scalars(
        select(Correction)
        .where(
            Correction.machine_id == machine.id,
            Correction.status == "applied",
            Correction.applied_at > now - LOOKED_BACK,
            Correction.tool_memory.in_({line.parameters.tool_memory for line in shown}),
        )
        .order_by(Correction.applied_at.desc(), Correction.number.desc())
        .limit(MOST_CORRECTIONS)
    ).all()
    newest = recent[0].applied_at if recent else None
    must_say = newest is not None and newest > now - MUST_BE_SAID
    return Sheet(shown[:MOST_LINES], drawings, chosen, recent, must_say)


def sections_of(parameters: Parameters) -> int:
    """The number of sizes that a person types for one reading; 0 where only touches of a probe will do.

    Acceptance by n of m takes the m sections, as single touches; distances of two points and repeats take a probe.
    """
    if parameters.accept_m == 1:
        return 1
    return parameters.accept_m if parameters.variant is not Variant.TWO_POINT and parameters.repeats == 1 else 0


def filled(
    sheet: Sheet,
    form: Mapping[str, str],
    person: str,
    now: datetime,
    required: Mapping[str, tuple[ContextField, ...]] = NONE_REQUIRED,
) -> Filled:
    """Read what was typed or scanned. Raises `Invalid` naming every field that is wrong, and when there is no size at all.

    required: what the context must say, by the key of the characteristic.
    """
    key, errors = form.get("key", ""), []
    if not _KEY.fullmatch(key):
        raise Invalid.at("key", _("this sheet has no number; open it again"))
    texts = {}
    for name in ("part", *SCANNED):
        texts[name] = form.get(name, "").strip()
        if len(texts[name]) > LONGEST_TEXT or not clean_text(texts[name]):
            errors.append(FieldError(name, _("at most {n} letters, digits and signs").format(n=LONGEST_TEXT)))
    cut_at, wrong = _cut_at(sheet, form.get("cut", ""))
    if texts["nest"] and not (texts["nest"].isascii() and texts["nest"].isdigit() and len(texts["nest"]) < 7):
        errors.append(FieldError("nest", _("a nest is a whole number from 0 to 999999")))
        texts["nest"] = ""
    taken: list[tuple[Entry, ReadingIn]] = []
    questions: dict[str, str] = {}
    for line in sheet.lines:
        sizes = _sizes(line, form, errors)
        if not sizes:
            continue
        for name, size in sizes.items():
            doubt = question(size, line.parameters)
            if doubt and plain(form.get(f"sure:{name}", "")) != plain(form[name]):
                questions[name] = doubt
        values = list(sizes.values())
        reading = ReadingIn(
            line.entry.characteristic,
            measured=values[0] if line.sections == 1 else None,
            touches=None if line.sections == 1 else [[value] for value in values],
            measured_at=now,
            machined_at=cut_at,
            part=texts["part"] or None,
            key=f"by-hand:{key}",
            context=_context(texts, person),
        )
        taken.append((line.entry, reading))
    if wrong and taken:
        errors.append(wrong)
    needed = {each for entry, _reading in taken for each in required.get(entry.characteristic, ())}
    errors += [
        FieldError(name, _("the control plan requires it with each reading; scan or type it"))
        for name in SCANNED
        if name in needed and not texts[name] and all(error.field != name for error in errors)
    ]
    if not taken and not errors:
        name = next((name for line in sheet.lines for name in line.fields), "part")
        errors.append(FieldError(name, _("type a size first")))
    if errors:
        raise Invalid(_("The sheet has to be corrected. Nothing was stored."), errors=errors)
    return Filled(taken, questions)


def _context(texts: Mapping[str, str], person: str) -> Context:
    said: dict[str, Any] = {field.value: texts[field] for field in SCANNED if texts[field]}
    if "nest" in said:
        said["nest"] = int(said["nest"])
    return Context(**said, operator=person[:LONGEST_TEXT], by_hand=True)


def _sizes(line: SheetLine, form: Mapping[str, str], errors: list[FieldError]) -> dict[str, float]:
    typed = {name: text for name in line.fields if (text := form.get(name, "").strip())}
    if typed and len(typed) < line.sections:
        empty = next(name for name in line.fields if name not in typed)
        errors.append(FieldError(empty, _("all {n} sections are needed").format(n=line.sections)))
    sizes = {}
    for name, text in typed.items():
        try:
            sizes[name] = read_number(text)
        except NotANumber as error:
            errors.append(FieldError(name, fault_words(error.fault)))
        else:
            if abs(sizes[name]) > LARGEST_LENGTH:
                errors.append(FieldError(name, _("longer than any machine; sizes are in mm")))
    return sizes


def fault_words(fault: NumberFault) -> str:
    """The reason why what was typed is not a size."""
    if fault is NumberFault.THOUSANDS:
        return _("write it without a separator of thousands")
    if fault is NumberFault.BRACKETS:
        return _("write it without brackets, with its sign if it is below 0")
    if fault is NumberFault.BOUND:
        return _("this is a bound, no size; measure it with a gauge that shows it")
    return _("this is not a size; write it like 39.998, in mm")


def question(size: float, parameters: Parameters) -> str | None:
    """The question about a size that is more likely a slip of the finger; None for one that is taken as it is."""
    deviation = size - parameters.target
    if not is_doubtful(deviation, parameters.half, parameters.wear_limit, parameters.natural_limit.side):
        return None
    if looks_like_inches(size, parameters.target):
        return _("{size} looks like inches. Sizes are in mm.").format(size=short(size, 9))
    sentence = (
        _("{size} mm is {off} above the target {target} mm. Really?")
        if deviation > 0
        else _("{size} mm is {off} below the target {target} mm. Really?")
    )
    return sentence.format(
        size=short(size, 9), off=um_limit(abs(round(deviation, 9)), ""), target=short(parameters.target, 9)
    )


def _cut_at(sheet: Sheet, said: str) -> tuple[datetime | None, FieldError | None]:
    """The moment at which the part was cut, None for just now: just before a correction that it did not have yet."""
    if said == LATEST or (not said and not sheet.must_say):
        return None, None
    for correction in sheet.recent:
        if said == str(correction.number) and correction.applied_at is not None:
            return correction.applied_at - timedelta(microseconds=1), None
    return None, FieldError("cut", _("choose when the part was cut; corrections made since then are counted"))


def store(
    session: Session, database: Database, writer: Writer, machine: Machine, sheet: Filled, caller: Caller
) -> None:
    """Decide and store the readings, all or none, each once. Raises what the door for readings raises.

    The transaction of the session is ended before, so that it holds nothing that the writer waits for.
    """
    session.commit()
    outcomes = store_batch(database, writer.parameters, sheet.readings, writer.idle)
    if all(isinstance(outcome, Stored) for outcome in outcomes):
        return
    record(
        session,
        caller.name,
        "sizes entered by hand",
        f"machine/{machine.key}",
        None,
        {reading.characteristic: reading.measured or reading.touches for _entry, reading in sheet.readings},
    )


def stored_of(session: Session, sheet: Sheet, key: str) -> list[tuple[SheetLine, dict[str, Any], dict[str, Any]]]:
    """The readings of a sheet that was sent, as they were answered, with their circumstances."""
    found = []
    for line in sheet.lines:
        at = (Reading.machine_id == line.entry.machine_id, Reading.characteristic_id == line.entry.characteristic_id)
        sequence = session.scalar(select(Reading.sequence).where(*at, Reading.key == f"by-hand:{key}"))
        if sequence is None:
            continue
        context = session.scalar(
            select(ReadingContext.context).where(
                ReadingContext.machine_id == line.entry.machine_id,
                ReadingContext.characteristic_id == line.entry.characteristic_id,
                ReadingContext.sequence == sequence,
            )
        )
        (answer,) = readings.answers(session, line.entry, [readings.record_of(session, line.entry, sequence)])
        found.append((line, answer, context or {}))
    return found
