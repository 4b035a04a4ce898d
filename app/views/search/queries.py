"""One search for all that has a name: machines, characteristics, tools, alarms, parts, notes, pages. Never writes."""

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from sqlalchemy import ColumnElement, Select, case, func, literal_column, or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.language.i18n import _
from app.loop.notes import queries as notes
from app.loop.notes.wording import beginning
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import PART_BEGINS, Reading, Stream
from app.loop.tables.tools import Tool
from app.views.search import readings
from app.views.search.doors import doors
from app.views.search.parts import part_path
from app.web.fields import LARGEST_ID, LARGEST_SERIAL
from app.web.states import word_of

Kind = Literal["machine", "characteristic", "tool", "alarm", "report", "part", "note", "page"]
MOST_OF_A_KIND = 6
MOST_OF_A_NOTE = 60  # characters
ACTIVE_ALARMS = 500  # that are looked through by their kind
LOOKED_THROUGH = 500_000  # readings, about: the newest, for parts whose name begins as typed


class Hit(NamedTuple):
    """Something that bears the name. key: what programs call it; path: its page."""

    kind: Kind
    key: str
    title: str
    path: str


def hits(session: Session, term: str, caller: Caller) -> list[Hit]:
    """Everything whose name holds the term, of each kind the best few; none of an empty term."""
    term = term.strip()
    if not term:
        return []
    searched = (_machines, _characteristics, _tools, _alarms, _parts, _notes)
    return [hit for search in searched for hit in search(session, term)] + list(_pages(term, caller))


def _best(term: str, *names: ColumnElement[str]) -> tuple[ColumnElement[bool], ColumnElement[int]]:
    """The condition that one of the names holds the term, and the rank: exact, at the beginning, anywhere."""
    lower = [func.lower(name) for name in names]
    rank = case(
        (or_(*(name == term.lower() for name in lower)), 0),
        (or_(*(name.startswith(term.lower(), autoescape=True) for name in lower)), 1),
        else_=2,
    )
    return or_(*(name.icontains(term, autoescape=True) for name in names)), rank


def _machines(session: Session, term: str) -> Iterator[Hit]:
    named, rank = _best(term, Machine.key, Machine.name)  # type: ignore[arg-type]
    query = select(Machine.key, Machine.name).where(named).order_by(rank, Machine.key).limit(MOST_OF_A_KIND)
    for key, name in session.execute(query):
        yield Hit("machine", key, name, f"/machines/{key}")


def _characteristics(session: Session, term: str) -> Iterator[Hit]:
    names = (Characteristic.key, Characteristic.name, func.coalesce(Characteristic.part, ""))
    named, rank = _best(term, *names)  # type: ignore[arg-type]
    report = _("Report").lower()
    wanted = term.lower().removeprefix(report).strip() if term.lower().startswith(report) else None
    if wanted:
        named, rank = _best(wanted, *names)  # type: ignore[arg-type]
    query = (
        select(Characteristic.key, Characteristic.name, Machine.name)
        .join(Machine, Machine.id == Characteristic.machine_id)
        .where(named)
        .order_by(rank, Characteristic.key)
        .limit(MOST_OF_A_KIND)
    )
    for key, name, machine in session.execute(query):
        if wanted:
            yield Hit("report", key, _("Report: {name}").format(name=name), f"/characteristics/{key}/report")
        else:
            yield Hit("characteristic", key, f"{name} ({key}), {machine}", f"/characteristics/{key}")


def _tools(session: Session, term: str) -> Iterator[Hit]:
    """Tools by number (*T3*, *tool 3*), as far as a characteristic corrects them, and by name."""
    number = _number(term, "t", _("tool"), most=LARGEST_SERIAL)
    query: Select[str, str, int, str | None] = (
        select(Machine.key, Machine.name, Tool.number, Tool.name)
        .join(Machine, Machine.id == Tool.machine_id)
        .order_by(Machine.key, Tool.number)
        .limit(MOST_OF_A_KIND)
    )
    used = select(Stream.tool_memory).where(Stream.machine_id == Tool.machine_id, Stream.tool_memory == Tool.number)
    named = Tool.name.icontains(term, autoescape=True)
    condition = named if number is None else or_(named, (Tool.number == number) & used.exists())
    for key, machine, tool, name in session.execute(query.where(condition)):
        title = _("Tool {number}").format(number=tool) + (f" {name}" if name else "") + f", {machine}"
        yield Hit("tool", f"{key}/{tool}", title, f"/machines/{key}/tools?tool={tool}#tool")


def _alarms(session: Session, term: str) -> Iterator[Hit]:
    """Any alarm by its number; the active ones by their kind."""
    query = select(Alarm.id, Alarm.kind, Machine.name).join(Machine, Machine.id == Alarm.machine_id)
    number = _number(term, "#", _("alarm"), most=LARGEST_ID)
    if number is not None:
        found = session.execute(query.where(Alarm.id == number)).all()
    else:
        active = query.where(Alarm.acknowledged_at.is_(None)).order_by(Alarm.id.desc()).limit(ACTIVE_ALARMS)
        found = [row for row in session.execute(active) if term.lower() in word_of(row.kind).lower()]
    for alarm, kind, machine in found[:MOST_OF_A_KIND]:
        yield Hit("alarm", str(alarm), f"{alarm} {word_of(kind)}, {machine}", f"/alarms/{alarm}")


def _number(term: str, *signs: str, most: int) -> int | None:
    """The number in *3*, *T3*, *tool 3*."""
    rest = term.lower()
    for sign in sorted(signs, key=len, reverse=True):
        rest = rest.removeprefix(sign.lower()).strip()
    return int(rest) if rest.isascii() and rest.isdecimal() and len(rest) < 20 and int(rest) <= most else None


def _parts(session: Session, term: str) -> Iterator[Hit]:
    """The part of this name, or those whose name begins so; in the letters as typed, in capitals or in small letters."""
    typed = list(dict.fromkeys((term, term.upper(), term.lower())))
    names = [name for name in typed if readings.found(session, readings.Filters(part=name), "newest", None, 1)]
    for part in names or sorted(_beginning(session, typed)[:MOST_OF_A_KIND]):
        yield Hit("part", part, part, part_path(part))


def _beginning(session: Session, typed: Sequence[str]) -> list[str]:
    """Names of parts among the newest readings that begin in one of these ways; none of a beginning too short for the index."""
    letters = min(map(len, typed))
    if letters < min(PART_BEGINS):
        return []
    conditions = [or_(*(func.starts_with(Reading.part, each) for each in typed))]
    for most in PART_BEGINS:
        if most <= letters:
            first = func.left(Reading.part, literal_column(str(most)))
            conditions.append(first.in_([each[:most] for each in typed]))
    last = readings.last_arrival(session)
    stored = session.scalar(select(func.sum(Stream.sequence))) or 0
    if stored > LOOKED_THROUGH:
        share = LOOKED_THROUGH / float(stored)
        conditions.append(Reading.received_at >= last - share * (last - readings.first_arrival(session)))
    query = select(Reading.part).group_by(Reading.part).order_by(func.max(Reading.received_at).desc())
    names: dict[str, None] = {}
    for window in readings.windows("newest", last):
        found = session.scalars(query.where(*conditions, *window).limit(MOST_OF_A_KIND))
        names |= dict.fromkeys(name for name in found if name is not None)
        if len(names) >= MOST_OF_A_KIND:
            break
    return list(names)


def _notes(session: Session, term: str) -> Iterator[Hit]:
    for row in notes.notes(session, named=term, limit=MOST_OF_A_KIND):
        title = f"{beginning(row.note.text, MOST_OF_A_NOTE)}, {row.about}"
        yield Hit("note", str(row.note.id), title, f"/notes/{row.note.id}")


def _pages(term: str, caller: Caller) -> Iterator[Hit]:
    lower = term.lower()
    found = [door for door in doors() if caller.may(door.role) and lower in f"{door.title}, {door.words}".lower()]
    for door in sorted(found, key=lambda door: lower not in door.title.lower())[:MOST_OF_A_KIND]:
        yield Hit("page", door.path, door.title, door.path)
