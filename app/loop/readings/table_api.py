"""JSON route: readings out of a table of someone else, as the command and the page of imports take it."""

from base64 import b64decode
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, Literal

from fastapi import Request
from pydantic import BaseModel, Field

from app.access.deps import Engineer
from app.db.engine import Database
from app.errors import Invalid
from app.files.apart import apart, spend
from app.files.formats import spreadsheet
from app.files.formats.delimited import BLANKS, Unusable
from app.files.formats.units import Unit
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.readings.importing import drawn, wide
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.layout import Layout, Wishes, refuse_incomplete
from app.loop.readings.importing.lines import look_apart, read_apart
from app.loop.readings.importing.wide import Column, ColumnResult
from app.web.api import api_router, problems
from app.web.deps import SessionDep
from app.web.fields import Body
from app.web.limits import MEGABYTE, takes

router = api_router("readings")
ENDINGS = (".csv", ".tsv", ".txt", ".ndjson", ".jsonl", ".json")
_Line = Annotated[int | None, Field(ge=1, le=10_000_000, strict=True)]
_Word = Annotated[str | None, Field(max_length=200)]


class TableImport(Body):
    """A table to import, as text or as a workbook, and what the program is not to find out by itself."""

    name: Annotated[
        str,
        Field(
            min_length=1,
            max_length=100,
            description="What the file is called; its ending says what it is: "
            "csv, tsv, txt, ndjson, jsonl or json; xlsx or xlsm of a workbook. For the record of changes.",
        ),
    ]
    content: Annotated[str, Field(min_length=1, description="The text of the file; of a workbook its bytes in Base64.")]
    sheet: Annotated[
        str | None, Field(max_length=100, description="Of a workbook; if left out, the first that has cells.")
    ] = None
    characteristic: Annotated[
        str | None, Field(max_length=64, description="The key of the characteristic, where all is of one.")
    ] = None
    characteristics: Annotated[
        dict[str, str],
        Field(
            default_factory=dict,
            max_length=1_000,
            description="Of a wide table by column, of one whose rows name their characteristic by that name: its key here, or + to "
            "set it up. Left out, they are found by their keys and names.",
        ),
    ]
    create_missing: Annotated[
        bool, Field(strict=True, description="Set up all that the rows describe and that are not here.")
    ] = False
    machine: Annotated[str | None, Field(max_length=64, description="Key of the machine on which they are set up.")] = (
        None
    )
    map: Annotated[
        dict[str, str],
        Field(
            default_factory=dict,
            max_length=20,
            description="Column by field, such as measured: Wert; an empty one: not in this table.",
        ),
    ]
    delimiter: Annotated[
        str | None, Field(max_length=6, description="One sign, or blanks for two of them and more.")
    ] = None
    decimal: Annotated[Literal[".", ","] | None, Field(description="The decimal sign; if left out, found out.")] = None
    unit: Annotated[Unit | None, Field(description="Of sizes whose header, row and cell name none.")] = None
    timezone: Annotated[
        _Word, Field(description="Zone of times without an offset; if left out, that of the plant.")
    ] = None
    time_format: Annotated[_Word, Field(description="Such as %d/%m/%Y %H:%M, or seconds since 1970-01-01.")] = None
    header_line: Annotated[_Line, Field(description="Of the names of the columns; if left out, found out.")] = None
    first_line: Annotated[_Line, Field(description="Of readings.")] = None
    last_line: Annotated[_Line, Field(description="Of readings; sums and means stand below.")] = None
    missing: Annotated[
        list[Annotated[str, Field(max_length=100)]],
        Field(
            default_factory=list,
            max_length=50,
            description="Marks in place of sizes that are missing; * for all without a digit.",
        ),
    ]
    dry_run: Annotated[bool, Field(strict=True, description="Say what would happen and store nothing.")] = False


class TableImportCharacteristic(BaseModel):
    """The result of one characteristic of the table."""

    name: Annotated[str, Field(description="Its column, or its name in the rows.")]
    characteristic: Annotated[str | None, Field(description="Its key here; null if it is left out.")] = None
    created: Annotated[bool, Field(description="It was set up by this import.")] = False
    stored: Annotated[int, Field(description="Readings that are new.")] = 0
    repeated: Annotated[int, Field(description="Readings that were stored before.")] = 0
    first_sequence: Annotated[int | None, Field(description="Number of the first new reading.")] = None
    left_out: Annotated[str | None, Field(description="The reason, if it is left out.")] = None
    trouble: Annotated[str | None, Field(description="With dry_run: why its readings cannot be stored.")] = None
    notes: Annotated[list[str], Field(description="What to know about its lines.")]


class TableImportResult(BaseModel):
    """The result of an import."""

    stored: Annotated[int, Field(description="Readings that are new, of all characteristics.")]
    repeated: Annotated[int, Field(description="Readings that were stored before.")]
    columns: Annotated[dict[str, str], Field(description="The column of each field, as the table was understood.")]
    unit: Annotated[str, Field(description="Of sizes whose row and cell name none.")]
    ignored: Annotated[list[str], Field(description="Columns that mean nothing here.")]
    characteristics: Annotated[
        list[TableImportCharacteristic], Field(description="Those that are imported, then those that are left out.")
    ]


@router.post("/readings/table", responses=problems(404, 409, 413))
@takes(64 * MEGABYTE, by="engineer")
def import_table(request: Request, session: SessionDep, caller: Engineer, given: TableImport) -> TableImportResult:
    """Import a table (CSV, text, NDJSON, JSON list, XLSX): all of it or nothing, as history: it corrects nothing and raises no alarm.

    Import it twice and nothing is stored twice. What is wrong is named by line and column. Readings as they are measured are
    sent to `/readings`.
    """
    database: Database = request.app.state.database
    session.commit()  # nothing is kept open while the table is read
    with _text_of(given) as path:
        layout = look_apart(path, _wishes(given), given.name).layout
        if given.characteristic or layout.names:
            refuse_incomplete(layout)
        how: dict[str, Any] = {"actor": caller.name, "source": given.name, "dry_run": given.dry_run}
        left_out: list[TableImportCharacteristic] = []
        if given.characteristic:
            results = [_one(database, path, layout, given.characteristic, how)]
        else:
            columns, left_out, machine = _columns(database, layout, given)
            results = wide.import_apart(database, columns, path, layout, unit=given.unit, machine=machine, **how)
    done = [each.summary for each in results if each.summary is not None]
    return TableImportResult(
        stored=sum(each.stored for each in done),
        repeated=sum(each.repeated for each in done),
        columns={name: layout.named(name) for name in layout.columns},
        unit=layout.unit,
        ignored=layout.ignored,
        characteristics=[
            *(_result(each, layout, alone=given.characteristic is not None) for each in results),
            *left_out,
        ],
    )


@contextmanager
def _text_of(given: TableImport) -> Iterator[Path]:
    """The table as a file of text. Raises `Invalid`."""
    ending = Path(given.name).suffix.lower()
    if ending not in {*ENDINGS, *spreadsheet.ENDINGS}:
        reason = _(
            "ends with none of {endings}; AQDEF is sent to /readings/aqdef, a workbook of old (xls) is saved as xlsx"
        )
        raise Invalid.at("name", reason.format(endings=", ".join((*ENDINGS, *sorted(spreadsheet.ENDINGS)))))
    with TemporaryDirectory() as folder:
        path = Path(folder, "table")
        if ending in ENDINGS:
            path.write_text(given.content, "utf-8", newline="")
            yield path
            return
        try:
            path.write_bytes(b64decode(given.content, validate=True))
        except ValueError:
            raise Invalid.at("content", _("is no Base64: the bytes of a workbook are sent so")) from None
        with _sheet(path, given.sheet) as text:
            yield text


@contextmanager
def _sheet(path: Path, name: str | None) -> Iterator[Path]:
    with ExitStack() as stack:
        try:
            text = stack.enter_context(
                spreadsheet.text_of(path, name, lambda *to: apart(spreadsheet.texts, *to, spend))
            )
        except Unusable as error:
            raise Invalid.at("content", str(error)) from None
        yield text


def _wishes(given: TableImport) -> Wishes:
    return Wishes(
        mapping=given.map,
        delimiter=BLANKS if given.delimiter == "blanks" else given.delimiter,
        decimal=given.decimal,
        unit=given.unit,
        timezone=given.timezone or plant_zone().key,
        time_format=given.time_format,
        encoding="utf-8-sig",
        header_line=given.header_line,
        first_line=given.first_line,
        last_line=given.last_line,
        missing=frozenset(given.missing),
    )


def _one(database: Database, path: Path, layout: Layout, key: str, how: dict[str, Any]) -> ColumnResult:
    with database.sessions() as session:
        current = characteristics.characteristic_named(session, key)
    layout = layout.of_one(key, current.characteristic.name)
    with read_apart(path, [layout]) as read:
        summary = import_readings(database, key, path, layout, read=read, **how)
    return ColumnResult(Column(0, key), summary)


def _columns(
    database: Database, layout: Layout, given: TableImport
) -> tuple[list[Column], list[TableImportCharacteristic], str | None]:
    """The columns, or names in the rows, that are chosen; those that are left out; and the machine for new ones."""
    said = given.characteristics.items()
    columns = wide.columns_named(said, layout) if said else wide.columns_known(database, layout)
    with_new, others, machine = wide.with_missing(database, columns, layout, given.machine)
    if given.create_missing:
        columns = with_new
        wide.refuse_none(columns, others)
    unknown = _("nothing here has its key or name; name it under characteristics")
    chosen = {column.place for column in columns}
    left_out = [
        TableImportCharacteristic(name=each.name, left_out=each.not_new or unknown, notes=[])
        for each in drawn.contents(layout)
        if each.index not in chosen
    ]
    return columns, left_out, machine


def _result(result: ColumnResult, layout: Layout, *, alone: bool) -> TableImportCharacteristic:
    column, summary, trouble, created = result
    name = layout.named("measured") if alone else layout.subjects[column.place]
    made = TableImportCharacteristic(name=name, characteristic=column.characteristic, created=created, notes=[])
    if summary is not None:
        made.stored, made.repeated, made.first_sequence = summary.stored, summary.repeated, summary.first_sequence
        made.notes = [*filter(None, [layout.on_times]), *summary.notes]
    if trouble is not None:
        made.trouble = " ".join([trouble.detail, *map(str, result.flaws[:20])])
    return made
