"""Wide sheets: one column a characteristic, one row a part. All columns are imported or none."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.db.engine import Database
from app.errors import FieldError, InbandError, Invalid
from app.files.formats import cell_values
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.readings import queries
from app.loop.readings.aqdef.actions import machine_for, set_up
from app.loop.readings.aqdef.matching import NEW, Content
from app.loop.readings.importing import drawn
from app.loop.readings.importing.cells import MOST_FLAWS, Flaw
from app.loop.readings.importing.columns import ORIGIN, column_unit
from app.loop.readings.importing.history import Flawed, Progress, Summary, store_history
from app.loop.readings.importing.layout import Layout
from app.loop.readings.importing.lines import Read, lines, read_apart, read_here
from app.loop.readings.records import Entry


class Column(NamedTuple):
    """A column of measured values (its place in the header) and the characteristic that it belongs to."""

    place: int
    characteristic: str


class ColumnResult(NamedTuple):
    """The result of one column: what was stored, or would be, or why it cannot be. created: its characteristic was set up."""

    column: Column
    summary: Summary | None
    trouble: InbandError | None = None
    created: bool = False

    @property
    def flaws(self) -> list[Flaw]:
        """Lines that are wrong."""
        return self.trouble.flaws if isinstance(self.trouble, Flawed) else []


def columns_by_name(layout: Layout, known: Sequence[CurrentCharacteristic]) -> dict[int, str]:
    """The columns whose name is the key or the name of a characteristic: its key by place in the header."""
    names: dict[str, set[str]] = {}  # Ring Bore and ring-bore, its name and its key, are alike
    for current in known:
        for name in (current.characteristic.key, current.characteristic.name):
            names.setdefault(cell_values.folded(name), set()).add(current.characteristic.key)
    found: dict[int, str] = {}
    taken = {place for field, places in layout.columns.items() if field != "measured" for place in places}
    for place, name in enumerate(layout.subjects):
        keys = names.get(cell_values.folded(name), set())
        if (layout.names or place not in taken) and len(keys) == 1 and not keys & set(found.values()):
            found[place] = next(iter(keys))
    return found


def layout_of(layout: Layout, column: Column, unit: str | None) -> Layout:
    """The layout by which one column is read; without a unit that a person said, that of its header counts, else mm."""
    if layout.names:
        return replace(layout, only=layout.names[column.place])
    fields = {
        name: places for name, places in layout.columns.items() if name not in {"measured", "touches", "key", *ORIGIN}
    }
    own_unit = column_unit(layout.header[column.place], unit) or (layout.units[column.place] if layout.units else None)
    if own_unit is None:
        layout.refuse_doubt()
    layout.refuse_thousands(column.place, own_unit)
    return replace(layout, columns=fields | {"measured": (column.place,)}, said_unit=own_unit, skips_blank=True)


def import_wide(
    database: Database,
    columns: Sequence[Column],
    path: Path,
    layout: Layout,
    *,
    unit: str | None,
    actor: str,
    source: str,
    dry_run: bool = False,
    machine: str | None = None,
    progress: Progress = lambda: None,
    read: Read | None = None,
) -> list[ColumnResult]:
    """Import every column as history of its characteristic, in one transaction.

    dry_run: say for each column what would happen, also what stands against it. Raises `NotFound`, `Flawed` and `Invalid`
    otherwise; then nothing is stored. read: the lines of each column, where they were read apart. machine: on which those
    are set up whose characteristic is `NEW`.
    """
    _refuse_twice(columns)
    layout.refuse_question()
    if read is None and layout.names:  # once for all names, of which a file may have a thousand
        how: dict[str, Any] = {"actor": actor, "source": source, "dry_run": dry_run, "progress": progress}
        with read_here(path, [_layout_of(layout, column, unit) for column in columns]) as held:
            return import_wide(database, columns, path, layout, unit=unit, machine=machine, read=held, **how)
    with database.sessions() as session:
        there = _with_new(session, columns, layout, machine, actor)
        entries = [(place, column, _entry(session, column)) for place, column in enumerate(there)]
        results = []
        # In the order of the machines, as everybody takes their locks.
        for place, column, entry in sorted(entries, key=lambda each: each[2].machine_id):
            created = columns[place].characteristic == NEW
            with session.begin_nested() as part:
                try:
                    own = layout_of(layout, column, unit)
                    found = (
                        lines(path, own, entry.characteristic) if read is None else read(place, entry.characteristic)
                    )
                    summary = store_history(session, entry, found, actor=actor, source=source, progress=progress)
                    results.append(ColumnResult(column, summary, created=created))
                except InbandError as trouble:
                    part.rollback()
                    results.append(ColumnResult(column, None, trouble))
        if dry_run:
            session.rollback()
        else:
            _refuse_flawed(results)
            session.commit()
    return sorted(results, key=lambda result: result.column.place)


def import_apart(
    database: Database,
    columns: Sequence[Column],
    path: Path,
    layout: Layout,
    *,
    unit: str | None,
    actor: str = "",
    source: str = "",
    dry_run: bool = False,
    machine: str | None = None,
) -> list[ColumnResult]:
    """The same with a file of someone else, which is read once, in a process of its own."""
    _refuse_twice(columns)
    layout.refuse_question()
    with read_apart(path, [_layout_of(layout, column, unit) for column in columns]) as read:
        how: dict[str, Any] = {"actor": actor, "source": source, "dry_run": dry_run, "machine": machine}
        return import_wide(database, columns, path, layout, unit=unit, read=read, **how)


def _layout_of(layout: Layout, column: Column, unit: str | None) -> Layout:
    """The same for a column whose unit is not known: it is refused when its turn comes, with its name."""
    try:
        return layout_of(layout, column, unit)
    except Invalid:
        return layout_of(layout, column, "mm")


def preview(
    database: Database, chosen: Mapping[int, str], path: Path, layout: Layout, *, unit: str | None, machine: str | None
) -> list[ColumnResult]:
    """The result that each column would have. Stores nothing."""
    columns = [Column(place, key) for place, key in chosen.items()]
    return import_apart(database, columns, path, layout, unit=unit, dry_run=True, machine=machine)


def _with_new(
    session: Session, columns: Sequence[Column], layout: Layout, machine: str | None, actor: str
) -> list[Column]:
    """The columns; those for `NEW` with the characteristic that is set up for them, as the rows describe it."""
    if all(column.characteristic != NEW for column in columns):
        return list(columns)
    described = {each.index: each for each in drawn.contents(layout)}
    taken = {each.characteristic.key: 1 for each in characteristics.characteristics(session)}
    made = []
    for column in columns:
        if column.characteristic == NEW:
            content = described.get(column.place)
            reason = content.not_new if content else _("only a table whose rows name their characteristic describes it")
            if content is None or reason:
                raise Invalid.at(layout.subjects[column.place], _("cannot be set up: {reason}").format(reason=reason))
            made.append(column._replace(characteristic=set_up(session, content, machine, actor, taken)))
        else:
            made.append(column)
    return made


def _refuse_twice(columns: Sequence[Column]) -> None:
    for key, count in Counter(column.characteristic for column in columns).items():
        if count > 1 and key != NEW:
            raise Invalid.at("columns", _("{key} is named for two columns; name it for one").format(key=key))
    if not columns:
        raise Invalid.at("columns", _("No column is said to be a characteristic; say which is which"))


def _entry(session: Session, column: Column) -> Entry:
    entry = queries.entry_of(
        session, characteristics.characteristic_named(session, column.characteristic).characteristic.key
    )
    assert entry is not None
    return entry


def _refuse_flawed(results: Sequence[ColumnResult]) -> None:
    """Raise what stands against any column, the errors of all of them together."""
    troubles = [result.trouble for result in results if result.trouble is not None]
    flawed = [trouble for trouble in troubles if isinstance(trouble, Flawed)]
    others = [trouble for trouble in troubles if not isinstance(trouble, Flawed)]
    if others:
        named = ((each.column.characteristic, each.trouble) for each in results if each.trouble is not None)
        others[0].detail = " ".join(f"{key}: {trouble.detail}" for key, trouble in named)
        raise others[0]
    if flawed:
        flaws: list[Flaw] = sorted(flaw for trouble in flawed for flaw in trouble.flaws)
        raise Flawed(flaws[:MOST_FLAWS], sum(trouble.count for trouble in flawed))


def columns_said(text: str, layout: Layout) -> list[Column]:
    """Columns from `D35=shaft-d35,3=shaft-d40`: a column by name or number, and the key of its characteristic."""
    pairs = (pair.rpartition("=") for pair in text.split(",") if pair.strip())
    return columns_named(((name.strip(), key.strip()) for name, _sign, key in pairs), layout)


def columns_named(pairs: Iterable[tuple[str, str]], layout: Layout) -> list[Column]:
    """Columns out of pairs of a name or number and the key of its characteristic. Raises `Invalid`."""
    found = []
    for name, key in pairs:
        place = layout.subjects.index(name) if name in layout.subjects else int(name) - 1 if name.isdecimal() else -1
        if not key or not 0 <= place < len(layout.subjects):
            there = ", ".join(layout.subjects)
            raise Invalid.at(
                "columns",
                _("{pair} names no column; the file has: {header}").format(pair=repr(f"{name}={key}"), header=there),
            )
        found.append(Column(place, key))
    return found


def columns_known(database: Database, layout: Layout) -> list[Column]:
    """The names in the rows that are keys or names of characteristics here."""
    with database.sessions() as session:
        known = characteristics.characteristics(session)
        return [Column(place, key) for place, key in columns_by_name(layout, known).items()]


def with_missing(
    database: Database, columns: Sequence[Column], layout: Layout, machine: str | None
) -> tuple[list[Column], list[Content], str | None]:
    """The columns, with `NEW` for all others that the rows describe; those that they do not; and the machine for new ones."""
    new, left_out = drawn.missing(layout, {column.place for column in columns})
    with database.sessions() as session:
        return [*columns, *(Column(each.index, NEW) for each in new)], left_out, machine_for(session, new, machine)


def refuse_none(columns: Sequence[Column], left_out: Sequence[Content]) -> None:
    """Refuse a table of which nothing can be set up. Raises `Invalid` with each reason."""
    if left_out and not columns:
        reasons = [FieldError(each.title, each.not_new) for each in left_out[:20]]
        raise Invalid(_("None of the characteristics of the table can be set up."), errors=reasons)


def columns_of(form: Mapping[str, str], layout: Layout) -> list[Column]:
    """Columns as chosen in a form: `to_3` is the key of the characteristic of the third column."""
    chosen = ((place, form.get(f"to_{place + 1}", "").strip()) for place in range(len(layout.subjects)))
    return [Column(place, key) for place, key in chosen if key]
