"""One search for all that has a name: machines, characteristics, tools, alarms, people, parts, notes, pages, help. Never writes."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Literal, NamedTuple
from urllib.parse import urlencode

from sqlalchemy import ColumnElement, Select, func, literal_column, or_, select
from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.access.tables import Person
from app.language.i18n import _
from app.loop.notes import queries as notes
from app.loop.notes.wording import beginning
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import PART_BEGINS, PART_ENDS, Reading, Stream
from app.loop.tables.tools import Tool
from app.views.help.queries import Section, sections
from app.views.search import readings
from app.views.search.doors import doors
from app.views.search.parts import part_path
from app.views.search.words import matching, rank, squeezed, words_of
from app.web.fields import LARGEST_ID, LARGEST_SERIAL
from app.web.states import word_of
from app.web.terms import terms

Kind = Literal["machine", "characteristic", "tool", "alarm", "report", "person", "part", "note", "page", "help"]
MOST_OF_A_KIND = 6
MOST_OF_A_NOTE = 60  # characters
ACTIVE_ALARMS = 500  # that are looked through by their kind
WHOLE, BEGINS, SOMEWHERE = 0, 1, 3  # ranks
LOOKED_THROUGH = 500_000  # readings, about: the newest, for parts whose name begins or ends as typed
SHORTEST_IN_TEXT = 3  # letters of a word that is looked for in the texts of help, not in their titles alone


class Hit(NamedTuple):
    """Something that bears the name. key: what programs call it; path: its page; rank: how well, as in `words.rank`."""

    kind: Kind
    key: str
    title: str
    path: str
    rank: int = BEGINS


def hits(session: Session, term: str, caller: Caller) -> list[Hit]:
    """Everything whose name holds all words of the term, of each kind the best few; none of an empty term.

    First what is called so, then where names or their words begin so, then the rest; within these, machines first, help last.
    """
    term = term.strip()
    words = words_of(term)
    if not words:
        return []
    found = [
        *_machines(session, words),
        *_characteristics(session, words),
        *_tools(session, words),
        *_alarms(session, term, words),
        *(_people(session, words, caller) if caller.may("engineer") else ()),
        *_parts(session, term),
        *_notes(session, term),
        *_pages(words, caller),
        *_help(term, words),
    ]
    return sorted(found, key=lambda hit: (hit.rank > WHOLE) + (hit.rank >= SOMEWHERE))


def _machines(session: Session, words: Sequence[str]) -> Iterator[Hit]:
    named, ranked = matching(words, Machine.key, Machine.name)  # type: ignore[arg-type]
    query = select(Machine.key, Machine.name, ranked).where(named).order_by(ranked, Machine.key).limit(MOST_OF_A_KIND)
    for key, name, how_well in session.execute(query):
        yield Hit("machine", key, name, f"/machines/{key}", how_well)


def _characteristics(session: Session, words: Sequence[str]) -> Iterator[Hit]:
    """By their own names, with words of the machine's name among them; after *report* their reports."""
    wanted = words[1:] if words[0] == _("Report").lower() else []
    words = wanted or words
    own = (Characteristic.key, Characteristic.name, Characteristic.part)
    named, ranked = matching(words, *own, Machine.key, Machine.name)  # type: ignore[arg-type]
    query = (
        select(Characteristic.key, Characteristic.name, Machine.name, ranked)
        .join(Machine, Machine.id == Characteristic.machine_id)
        .where(named, or_(*(matching([word], *own)[0] for word in words)))  # type: ignore[arg-type]
        .order_by(ranked, Characteristic.key)
        .limit(MOST_OF_A_KIND)
    )
    for key, name, machine, how_well in session.execute(query):
        if wanted:
            yield Hit("report", key, _("Report: {name}").format(name=name), f"/characteristics/{key}/report", how_well)
        else:
            yield Hit("characteristic", key, f"{name} ({key}), {machine}", f"/characteristics/{key}", how_well)


def _tools(session: Session, words: Sequence[str]) -> Iterator[Hit]:
    """Tools by number (*T3*, *tool 3*), as far as a characteristic corrects them, and by name; with words of the machine's."""
    query: Select[str, str, int, str | None] = (
        select(Machine.key, Machine.name, Tool.number, Tool.name)
        .join(Machine, Machine.id == Tool.machine_id)
        .limit(MOST_OF_A_KIND)
    )
    names = (Tool.name, Machine.key, Machine.name)
    named, ranked = matching(words, *names)  # type: ignore[arg-type]
    conditions = [named & or_(*(matching([word], Tool.name)[0] for word in words))]  # type: ignore[arg-type]
    number, others = _tool_number(words)
    if number is not None:
        used = select(Stream.tool_memory).where(Stream.machine_id == Tool.machine_id, Stream.tool_memory == Tool.number)
        conditions.append((Tool.number == number) & used.exists() & matching(others, *names)[0])  # type: ignore[arg-type]
    query = query.where(or_(*conditions)).order_by(ranked, Machine.key, Tool.number)
    for key, machine, tool, name in session.execute(query):
        title = _("Tool {number}").format(number=tool) + (f" {name}" if name else "") + f", {machine}"
        yield Hit("tool", f"{key}/{tool}", title, f"/machines/{key}/tools?tool={tool}#tool")


def _tool_number(words: Sequence[str]) -> tuple[int | None, Sequence[str]]:
    """The number of a tool in *3*, *T3*, *tool 3*, and the words beside it.

    >>> _tool_number(["t3", "lathe1"]), _tool_number(["lathe", "tool", "3"]), _tool_number(["3"]), _tool_number(["seat", "40"])
    ((3, ['lathe1']), (3, ['lathe']), (3, []), (None, ['seat', '40']))
    """
    if len(words) == 1 and (alone := _number(words[0], most=LARGEST_SERIAL)) is not None:
        return alone, []
    for at, word in enumerate(words):
        spoken = word == _("tool") and at + 1 < len(words)
        number = _number(words[at + 1] if spoken else word, "" if spoken else "t", most=LARGEST_SERIAL)
        if number is not None and (spoken or not word.isdecimal()):
            return number, [*words[:at], *words[at + 1 + spoken :]]
    return None, words


def _alarms(session: Session, term: str, words: Sequence[str]) -> Iterator[Hit]:
    """Any alarm by its number; the active ones by their kind, with words of the machine's name."""
    query = select(Alarm.id, Alarm.kind, Machine.key, Machine.name).join(Machine, Machine.id == Alarm.machine_id)
    number = _number(term, "#", _("alarm"), most=LARGEST_ID)
    if number is not None:
        found = session.execute(query.where(Alarm.id == number)).all()
    else:
        active = query.where(Alarm.acknowledged_at.is_(None)).order_by(Alarm.id.desc()).limit(ACTIVE_ALARMS)
        found = [row for row in session.execute(active) if _names_alarm(words, *row[1:])]
    for alarm, kind, _key, machine in found[:MOST_OF_A_KIND]:
        yield Hit("alarm", str(alarm), f"{alarm} {word_of(kind)}, {machine}", f"/alarms/{alarm}")


def _names_alarm(words: Sequence[str], kind: str, key: str, machine: str) -> bool:
    own = (kind, word_of(kind), _("alarm"))
    return rank(words, *own, key, machine) is not None and any(rank([word], *own) is not None for word in words)


def _number(term: str, *signs: str, most: int) -> int | None:
    """The number in *3*, *T3*, *tool 3*."""
    rest = term.lower()
    for sign in sorted(signs, key=len, reverse=True):
        rest = rest.removeprefix(sign.lower()).strip()
    return int(rest) if rest.isascii() and rest.isdecimal() and len(rest) < 20 and int(rest) <= most else None


def _people(session: Session, words: Sequence[str], caller: Caller) -> Iterator[Hit]:
    """An administrator is led to the person; an engineer, who may read the record of changes, to what that person did."""
    named, ranked = matching(words, Person.name)  # type: ignore[arg-type]
    query = select(Person.id, Person.name, ranked).where(named).order_by(ranked, Person.name).limit(MOST_OF_A_KIND)
    for number, name, how_well in session.execute(query):
        if caller.may("admin"):
            yield Hit("person", name, name, f"/setup/people#person-{number}", how_well)
        else:
            title = _("{name}: record of changes").format(name=name)
            yield Hit("person", name, title, f"/setup/audit?{urlencode({'actor': name})}", how_well)


def _parts(session: Session, term: str) -> Iterator[Hit]:
    """The part of this name, or those whose name begins or ends so; in the letters as typed, in capitals or in small letters."""
    typed = list(dict.fromkeys((term, term.upper(), term.lower())))
    names = [name for name in typed if readings.found(session, readings.Filters(part=name), "newest", None, 1)]
    how_well = WHOLE if names else BEGINS
    if not names and min(map(len, typed)) >= min(PART_BEGINS):
        names = sorted(_looked_through(session, _begins(typed)))
        ends = _looked_through(session, _ends(typed)) if len(names) < MOST_OF_A_KIND else []
        names += [name for name in ends if name not in names]
    for part in names[:MOST_OF_A_KIND]:
        yield Hit("part", part, part, part_path(part), how_well)


def _begins(typed: Sequence[str]) -> list[ColumnElement[bool]]:
    """Conditions of a part whose name begins in one of these ways: those of the index, and all letters."""
    letters = min(map(len, typed))
    of_index = [
        func.left(Reading.part, literal_column(str(most))).in_([each[:most] for each in typed])
        for most in PART_BEGINS
        if most <= letters
    ]
    return [*of_index, or_(*(func.starts_with(Reading.part, each) for each in typed))]


def _ends(typed: Sequence[str]) -> list[ColumnElement[bool]]:
    """The same of a part whose name ends so."""
    letters = min(map(len, typed))
    of_index = [
        func.right(Reading.part, literal_column(str(most))).in_([each[-most:] for each in typed])
        for most in PART_ENDS
        if most <= letters
    ]
    return [*of_index, or_(*(func.right(Reading.part, len(each)) == each for each in typed))]


def _looked_through(session: Session, conditions: list[ColumnElement[bool]]) -> list[str]:
    """Names of parts among the newest readings that meet these conditions, the newest first."""
    last = readings.last_arrival(session)
    stored = session.scalar(select(func.sum(Stream.sequence))) or 0
    if stored > LOOKED_THROUGH:
        share = LOOKED_THROUGH / float(stored)
        conditions = [*conditions, Reading.received_at >= last - share * (last - readings.first_arrival(session))]
    query = select(Reading.part).group_by(Reading.part).order_by(func.max(Reading.received_at).desc())
    names: dict[str, None] = {}
    for window in readings.windows("newest", last):
        found = session.scalars(query.where(*conditions, *window).limit(MOST_OF_A_KIND))
        names |= dict.fromkeys(name for name in found if name is not None)
        if len(names) >= MOST_OF_A_KIND:
            break
    return list(names)[:MOST_OF_A_KIND]


def _notes(session: Session, term: str) -> Iterator[Hit]:
    for row in notes.notes(session, holding=term, limit=MOST_OF_A_KIND):
        title = f"{beginning(row.note.text, MOST_OF_A_NOTE)}, {row.about}"
        yield Hit("note", str(row.note.id), title, f"/notes/{row.note.id}")


def _pages(words: Sequence[str], caller: Caller) -> Iterator[Hit]:
    found = []
    for door in doors():
        of_title = rank(words, door.title)
        if caller.may(door.role) and (
            of_title is not None or rank(words, door.title, *door.words.split(", ")) is not None
        ):
            found.append(Hit("page", door.path, door.title, door.path, SOMEWHERE if of_title is None else of_title))
    yield from sorted(found, key=lambda hit: hit.rank)[:MOST_OF_A_KIND]


@cache
def _texts_of_help() -> list[tuple[Section, str]]:
    return [(section, squeezed(f"{section.title} {section.words}")) for section in sections()]


def _help(term: str, words: Sequence[str]) -> Iterator[Hit]:
    """The row of the glossary; sections of help whose title says it; those in whose text all words occur, the most often first."""
    if row := terms().get(" ".join(term.lower().split())):
        yield Hit("help", row.path, _("Glossary: {name}").format(name=term), row.path, WHOLE)
    in_text = min(map(len, words)) >= SHORTEST_IN_TEXT and not all(map(str.isdecimal, words))
    found = []
    for section, text in _texts_of_help():
        of_title = rank(words, section.title)
        if of_title is not None or (in_text and all(word in text for word in words)):
            how_well = SOMEWHERE + 1 if of_title is None else of_title
            often = sum(map(text.count, words))
            found.append((how_well, -often, Hit("help", section.path, section.title, section.path, how_well)))
    yield from (hit for _rank, _often, hit in sorted(found, key=lambda each: each[:2])[:MOST_OF_A_KIND])
