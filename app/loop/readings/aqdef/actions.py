"""Import of an AQDEF file: all of it or nothing, as history of each characteristic (decision 15)."""

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

from sqlalchemy import func, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.errors import FieldError, InbandError, Invalid
from app.files.apart import apart
from app.files.aqdef.description import Description, Source
from app.files.formats.cell_values import folded
from app.files.formats.delimited import Unusable
from app.files.formats.repeats import once
from app.language.i18n import _, ngettext
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics import queries as characteristic_queries
from app.loop.machines import queries as machines
from app.loop.readings import queries
from app.loop.readings.actions import exclude_all
from app.loop.readings.aqdef import matching
from app.loop.readings.aqdef.content import Readings, put_down
from app.loop.readings.aqdef.matching import NEW, Content
from app.loop.readings.aqdef.queries import count_alike, remembered
from app.loop.readings.aqdef.sorting import Sorted, Wishes, described
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.history import Flawed, Summary, store_history
from app.loop.readings.records import Entry
from app.loop.tables.readings import ImportMapping, Reading

MEANINGS = {1: "cut off before its end", 129: "invalid", 290: "implausible", 304: "reference value"}
"""K0002, as example files of the format have it in words around it: 1 of lives, 304 of gauge studies."""
_JOINERS = "\N{ZERO WIDTH NON-JOINER}\N{ZERO WIDTH JOINER}"


@dataclass(frozen=True)
class Result:
    """The result of one characteristic. excluded: readings that the file marks. trouble: why it cannot be stored."""

    content: Content
    key: str
    created: bool
    summary: Summary | None = None
    excluded: int = 0
    doubts: tuple[str, ...] = ()
    trouble: InbandError | None = None

    @property
    def flaws(self) -> list[Flaw]:
        """Lines that are wrong."""
        return self.trouble.flaws if isinstance(self.trouble, Flawed) else []


@dataclass
class Outcome:
    """The result of a file."""

    results: list[Result] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    @property
    def stored(self) -> int:
        """Readings that are new."""
        return sum(each.summary.stored for each in self.results if each.summary)

    @property
    def repeated(self) -> int:
        """Readings that were there."""
        return sum(each.summary.repeated for each in self.results if each.summary)

    @property
    def refused(self) -> list[Content]:
        """Characteristics that cannot be imported, where others can."""
        bad = [each.content for each in self.results if each.trouble is not None]
        return bad if len(bad) < len(self.results) else []


def describe(source: Source, *, foreign: bool = False) -> Description:
    """The description of a file; of a foreign one by a process of its own. Raises `Invalid`."""
    try:
        return apart(described, source) if foreign else described(source)
    except Unusable as error:
        raise _unusable(error) from None


def _unusable(error: Unusable) -> Invalid:
    where = _("line {line}").format(line=error.line) if error.line else "file"
    return Invalid.at(where, str(error).removesuffix("."))


def guess(session: Session, found: Sequence[Content]) -> dict[int, str]:
    """The characteristics here that those of the file are, as far as it is known."""
    known = characteristic_queries.characteristics(session)
    return matching.guessed(found, known, remembered(session))


def with_missing(chosen: Mapping[int, str], found: Sequence[Content]) -> dict[int, str]:
    """The choices, and `NEW` for all others that can be set up."""
    return dict(chosen) | {
        each.index: NEW for each in found if each.index not in chosen and not each.obstacle and not each.not_new
    }


def machine_for(session: Session, found: Sequence[Content], named: str | None) -> str | None:
    """The machine on which missing ones are set up: the one named, the one the file names, or the only one."""
    if named:
        return machines.machine_named(session, named).key
    there = machines.machines(session)
    words = {folded(each.machine) for each in found if each.machine}
    fitting = [each for each in there if words & {folded(each.key), folded(each.name)}]
    every = fitting or list(there)
    return every[0].key if len(every) == 1 else None


def import_aqdef(
    database: Database,
    source: Source,
    description: Description,
    chosen: Mapping[int, str],
    wishes: Wishes,
    *,
    machine: str | None,
    actor: str,
    name: str,
    dry_run: bool = False,
    most: int | None = None,
    progress: Callable[[], None] = lambda: None,
    foreign: bool = False,
) -> Outcome:
    """Import the characteristics that are chosen, in one transaction.

    chosen: the key of the characteristic here for each index of the file, `NEW` to set it up on the machine, or nothing to leave
    it out. dry_run: say what would happen, for each also what stands against it. foreign: read in a process of its own. Raises `Invalid`, `Flawed`, `NotFound` and `Conflict`.
    """
    found = {each.index: each for each in matching.contents(description, wishes.unit)}
    chosen = {index: key for index, key in chosen.items() if key}
    _refuse(chosen, found)
    wanted = {index: found[index] for index in chosen}
    outcome = Outcome()
    try:
        with (
            put_down(source, wanted, wishes, progress, most, foreign=foreign) as readings,
            database.sessions() as session,
        ):
            found_there = readings.found
            if found_there.flaws:
                raise _flawed(found_there, wanted, list(found.values()))
            if not found_there.counted.total() and (missing := found_there.missing.total()):
                raise Invalid.at(
                    "file",
                    _(
                        "it holds no size of what is chosen: each of {count} values is empty, counts parts, or is marked as "
                        "missing or deleted (K0002 = 255, 256)"
                    ).format(count=missing),
                )
            if not found_there.counted.total():
                raise Invalid.at(
                    "file",
                    _("it holds no value of what is chosen; the values of a .dfd lie in the .dfx that belongs to it"),
                )
            outcome.remarks = once(description.remarks) + readings.sentences()
            outcome.results = _store_all(session, readings, wanted, chosen, machine, actor, name)
            if dry_run:
                session.rollback()
                return outcome
            if refused := [each for each in outcome.results if each.trouble is not None]:
                raise _refusal(refused, wanted, list(found.values()))
            _remember(session, outcome.results, actor)
            session.commit()
    except Unusable as error:
        raise _unusable(error) from None
    return outcome


def _flawed(there: Sorted, wanted: Mapping[int, Content], found: Sequence[Content]) -> Flawed:
    """The refusal of lines that are wrong."""
    refusal = Flawed(there.flaws, there.flaw_count)
    named = [re.fullmatch(r"K\d{4}/(\d+)", flaw.column) for flaw in there.flaws]
    indices = {int(match[1]) if match else None for match in named}
    if there.flaw_count == len(there.flaws) and indices <= wanted.keys():
        _say_how_others_go(refusal, [wanted[index] for index in wanted if index in indices], wanted, found)
    return refusal


def _refusal(refused: Sequence[Result], wanted: Mapping[int, Content], found: Sequence[Content]) -> InbandError:
    """The first trouble, with the words of all of them."""
    troubles = [each.trouble for each in refused if each.trouble is not None]
    first = next((each for each in troubles if not isinstance(each, Flawed)), troubles[0])
    words = " ".join(f"{each.key}: {each.trouble.detail}" for each in refused if each.trouble is not None)
    if isinstance(first, Flawed):
        first.flaws = [flaw for each in refused for flaw in each.flaws]
        first.count = sum(each.count for each in troubles if isinstance(each, Flawed))
    first.errors = [error for each in troubles for error in each.errors]
    first.detail = words
    _say_how_others_go(first, [each.content for each in refused], wanted, found)
    return first


def _say_how_others_go(
    refusal: InbandError, some: Sequence[Content], wanted: Mapping[int, Content], found: Sequence[Content]
) -> None:
    """Add to the advice how the characteristics that are not these are imported, if there are any."""
    if others := len(wanted) - len(some):
        text = _(
            "To import the other {count}, leave out what cannot be: --map '{argument}' (on the page: an empty field here)."
        )
        text = text.format(count=others, argument=matching.leaving_out(some, found))
        refusal.what_to_do = " ".join(filter(None, (refusal.what_to_do, text)))


def _refuse(chosen: Mapping[int, str], found: Mapping[int, Content]) -> None:
    if not chosen:
        against = [(each.line, each.title, each.obstacle or each.not_new) for each in found.values()]
        reasons = [
            FieldError(_("line {line}").format(line=line) if line else "file", f"{title}: {reason}")
            for line, title, reason in against
            if reason
        ]
        if reasons and len(reasons) == len(against):
            raise Invalid(_("None of the file's characteristics can be imported."), errors=reasons[:20])
        raise Invalid(_("None of the file's characteristics is chosen; say which is which."), errors=reasons[:20])
    keys = Counter(key for key in chosen.values() if key != NEW)
    for index, key in chosen.items():
        content = found.get(index)
        if content is None:
            raise Invalid.at("characteristics", _("the file has no characteristic {index}").format(index=index))
        reason = content.obstacle or (content.not_new if key == NEW else "")
        if reason:
            raise Invalid.at(content.title, reason)
        if keys[key] > 1:
            raise Invalid.at("characteristics", _("{key} is named for two characteristics of the file").format(key=key))


def _store_all(
    session: Session,
    readings: Readings,
    wanted: Mapping[int, Content],
    chosen: Mapping[int, str],
    machine: str | None,
    actor: str,
    name: str,
) -> list[Result]:
    entries: list[tuple[Entry, Content, bool]] = []
    taken: dict[str, int] = {}
    if NEW in chosen.values():
        known = characteristic_queries.characteristics(session)
        taken = dict.fromkeys((each.characteristic.key for each in known), 1)
    for index, content in wanted.items():
        created = chosen[index] == NEW
        key = set_up(session, content, machine, actor, taken) if created else chosen[index]
        taken.setdefault(key, 1)
        key = characteristic_queries.characteristic_named(session, key).characteristic.key
        entries.append((queries.entry_named(session, key), content, created))
    results = {}
    # In the order of the machines, as everybody takes their locks.
    for entry, content, created in sorted(entries, key=lambda each: each[0].machine_id):
        results[content.index] = _store(session, readings, entry, content, created=created, actor=actor, name=name)
    return [results[index] for index in wanted]


def _store(
    session: Session, readings: Readings, entry: Entry, content: Content, *, created: bool, actor: str, name: str
) -> Result:
    current = characteristic_queries.characteristic_named(session, entry.characteristic)
    doubts = tuple(matching.doubts(content, current.parameters))
    if not readings.found.counted[content.index]:
        return Result(
            content, entry.characteristic, created, Summary(), doubts=(*doubts, _("the file has no size of it"))
        )
    with session.begin_nested() as part:
        try:
            lines = readings.lines(content.index, entry.characteristic)
            summary = store_history(session, entry, lines, actor=actor, source=name, progress=lambda: None)
            excluded = _exclude(session, entry, readings.found.excluded.get(content.index, {}), summary, actor, name)
        except InbandError as trouble:
            part.rollback()
            return Result(content, entry.characteristic, created, doubts=doubts, trouble=trouble)
    if alike := count_alike(session, entry, summary):
        doubts += (
            ngettext(
                "%(num)d has time, size and part of a reading that is here already, which came in another way: is it the same?",
                "%(num)d have time, size and part of readings that are here already, which came in another way: are they the same?",
                alike,
            )
            % {"num": alike},
        )
    return Result(content, entry.characteristic, created, summary, excluded, doubts)


def set_up(session: Session, content: Content, machine: str | None, actor: str, taken: dict[str, int]) -> str:
    """Set up a characteristic of a file with the limits that it has there; its key. taken: as `matching.key_for` has it."""
    if machine is None:
        raise Invalid.at("machine", _("say on which machine new characteristics are set up"))
    given = characteristics.CharacteristicIn(
        key=matching.key_for(content, taken),
        name=(_seen(content.name) or _seen(content.title) or f"aqdef {content.index}")[:200],
        machine=machine,
        part=(_seen(content.part) or _seen(content.part_name))[:200] or None,
        parameters=matching.parameters_of(content),
    )
    return characteristics.add_characteristic(session, given, actor).characteristic.key


def _seen(text: str) -> str:
    """The text without signs that nobody sees, which no name here may hold; joiners are part of some scripts."""
    return "".join(each for each in text if unicodedata.category(each) != "Cf" or each in _JOINERS).strip()


def _exclude(
    session: Session, entry: Entry, marked: Mapping[int, Sequence[str]], summary: Summary, actor: str, name: str
) -> int:
    """Exclude the new readings that the file marks as not to be evaluated."""
    if not summary.stored or not marked:
        return 0
    count = 0
    for attribute, keys in marked.items():
        sequences = session.scalars(
            select(Reading.sequence).where(
                Reading.machine_id == entry.machine_id,
                Reading.characteristic_id == entry.characteristic_id,
                Reading.sequence >= summary.first_sequence,
                Reading.key == func.any(list(keys)),
            )
        ).all()
        meaning = MEANINGS.get(attribute, "not to be evaluated")
        reason = _("K0002 = {attribute} ({meaning}) in {file}").format(attribute=attribute, meaning=meaning, file=name)
        for begin in range(0, len(sequences), 5_000):
            count += len(exclude_all(session, entry, sequences[begin : begin + 5_000], actor, reason))
    return count


def _remember(session: Session, results: Sequence[Result], actor: str) -> None:
    """Keep what belongs together, for the next file of the same part."""
    for each in results:
        entry = queries.entry_named(session, each.key)
        part, number, name = each.content.identity
        values = {"part": part, "number": number, "name": name, "actor": actor, "at": datetime.now(UTC)}
        where = {"machine_id": entry.machine_id, "characteristic_id": entry.characteristic_id}
        session.execute(
            insert(ImportMapping)
            .values(**where, **values)
            .on_conflict_do_update(
                index_elements=["machine_id", "characteristic_id", "part", "number", "name"],
                set_={"actor": actor, "at": values["at"]},
            )
        )
