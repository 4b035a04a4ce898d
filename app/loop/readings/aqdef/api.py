"""JSON routes: readings as an AQDEF file, and out of one."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from fastapi import Query, Request, Response
from pydantic import BaseModel, Field

from app.access.deps import AnyCaller, Engineer
from app.db.engine import Database
from app.errors import Invalid
from app.files.aqdef.description import Source
from app.files.aqdef.times import day_order
from app.files.formats import cell_values
from app.files.formats.cell_values import Unreadable
from app.files.formats.repeats import once
from app.files.formats.units import Unit
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.readings.aqdef import actions, matching
from app.loop.readings.aqdef.actions import Outcome, Result
from app.loop.readings.aqdef.export import write_aqdef
from app.loop.readings.aqdef.matching import Content
from app.loop.readings.aqdef.sorting import Wishes
from app.web.api import api_router, problems
from app.web.choice import InPeriod
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.fields import Body
from app.web.limits import MEGABYTE, takes

router = api_router("readings")
AQDEF = "text/plain"
MOST = 200_000  # readings of one answer; longer files are written by the command
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file, written to AQDEF",
        "content": {
            AQDEF: {
                "schema": {"type": "string"},
                "example": "K0100 1\r\nK1001/1 shaft-0815\r\nK2001/1 shaft-d40\r\nK2002/1 Bearing seat\r\n",
            }
        },
    }
}


@router.get("/readings.dfq", responses=problems(404) | FILE, response_model=None, response_class=Response)
def get_aqdef(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: Annotated[
        str,
        Query(max_length=2000, description="Keys of the characteristics, parted by commas.", examples=["shaft-d40"]),
    ],
    period: InPeriod,
    last: Annotated[int, Query(ge=1, le=MOST, description="Of each characteristic only the last N.")] = 10_000,
) -> Response:
    """Readings of several characteristics as an AQDEF file (Q-DAS, `.dfq`): values, validity, events, limits, catalogues."""
    keys = list(dict.fromkeys(key.strip() for key in characteristic.split(",") if key.strip()))
    for key in keys:
        characteristics.characteristic_for(session, caller, key, "viewer")
    if len(keys) * last > MOST:
        raise Invalid.at("last", _("at most {most} readings come in one answer; ask for fewer").format(most=MOST))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "readings.dfq"
        write_aqdef(session, keys, path, period=period, last=last)
        content = path.read_bytes()
    name = keys[0] if len(keys) == 1 else "readings"
    return download(content, f"{name}.dfq", AQDEF)


class AqdefIn(Body):
    """An AQDEF file to import, decoded to text, and which of its characteristics is which here."""

    name: Annotated[
        str, Field(min_length=1, max_length=100, description="What the file is called: for the record of changes.")
    ]
    content: Annotated[str, Field(min_length=1, description="The text of the .dfq, or of the .dfd.")]
    values: Annotated[str | None, Field(min_length=1, description="The text of the .dfx, where content is a .dfd.")] = (
        None
    )
    characteristics: Annotated[
        dict[str, str],
        Field(
            default_factory=dict,
            max_length=10_000,
            description="By number (K2001) or name (K2002), before it the part (K1001) and a colon if need be: the key of the "
            "characteristic here, + to set it up, or nothing to leave it out. Those that are remembered, or of the same number or name, may be left out.",
        ),
    ]
    create_missing: Annotated[bool, Field(strict=True, description="Set up all that are not here yet.")] = False
    machine: Annotated[str | None, Field(max_length=64, description="Key of the machine on which they are set up.")] = (
        None
    )
    timezone: Annotated[
        str | None, Field(max_length=64, description="Zone of the file's times; if left out, that of the plant.")
    ] = None
    unit: Annotated[Unit | None, Field(description="Of lengths for which the file names none.")] = None
    day_first: Annotated[
        bool | None,
        Field(
            strict=True,
            description="Dates with / begin with the day (true) or the month (false); if left out, dates that could be either "
            "are refused.",
        ),
    ] = None
    dry_run: Annotated[bool, Field(strict=True, description="Say what would happen and store nothing.")] = False


class AqdefCharacteristic(BaseModel):
    """The result of one characteristic of the file."""

    index: Annotated[int, Field(description="Its index in the file.")]
    part: Annotated[str, Field(description="K1001, else K1002.")]
    number: Annotated[str, Field(description="K2001.")]
    name: Annotated[str, Field(description="K2002.")]
    characteristic: Annotated[str | None, Field(description="Its key here; null if it is left out.")] = None
    created: Annotated[bool, Field(description="true: it was set up from the file.")] = False
    stored: Annotated[int, Field(description="Readings that are new.")] = 0
    repeated: Annotated[int, Field(description="Readings that were stored before.")] = 0
    excluded: Annotated[int, Field(description="Of the new ones, those that the file marks as not valid (K0002).")] = 0
    left_out: Annotated[str | None, Field(description="The reason, if it is left out.")] = None
    trouble: Annotated[str | None, Field(description="With dry_run: why its readings cannot be stored.")] = None
    notes: Annotated[list[str], Field(description="What to know about it.")]


class AqdefResult(BaseModel):
    """The result of an import."""

    stored: Annotated[int, Field(description="Readings that are new.")]
    repeated: Annotated[int, Field(description="Readings that were stored before.")]
    characteristics: Annotated[
        list[AqdefCharacteristic], Field(description="The result of each characteristic of the file.")
    ]
    notes: Annotated[list[str], Field(description="What to know about the file: fields, lines, times.")]


@router.post("/readings/aqdef", responses=problems(404, 409, 413))
@takes(64 * MEGABYTE, by="engineer")
def import_aqdef(request: Request, session: SessionDep, caller: Engineer, given: AqdefIn) -> AqdefResult:
    """Import an AQDEF file (Q-DAS): all of it or nothing, as history: it corrects nothing and raises no alarm.

    Import it twice and nothing is stored twice. What is wrong is named by line and field.
    """
    wishes = _wishes(given)
    database: Database = request.app.state.database
    with TemporaryDirectory() as folder:
        source = _written(Path(folder), given)
        session.commit()  # nothing is kept open while the file is read
        description = actions.describe(source, foreign=True)
        found = matching.contents(description, wishes.unit)
        with database.sessions() as looking:
            chosen = _chosen(actions.guess(looking, found), given, found)
            machine = actions.machine_for(looking, found, given.machine)
        outcome = Outcome(remarks=once(description.remarks))
        if chosen or not given.dry_run:
            outcome = actions.import_aqdef(
                database,
                source,
                description,
                chosen,
                wishes,
                machine=machine,
                actor=caller.name,
                name=given.name,
                dry_run=given.dry_run,
                foreign=True,
            )
    results = {each.content.index: each for each in outcome.results}
    return AqdefResult(
        stored=outcome.stored,
        repeated=outcome.repeated,
        characteristics=[_result(each, results.get(each.index), chosen.get(each.index)) for each in found],
        notes=outcome.remarks,
    )


def _wishes(given: AqdefIn) -> Wishes:
    try:
        zone = cell_values.zone_named(given.timezone) if given.timezone else plant_zone()
    except Unreadable as error:
        raise Invalid.at("timezone", str(error)) from None
    return Wishes(zone, day_order(given.day_first), given.unit)


def _written(folder: Path, given: AqdefIn) -> Source:
    description, values = folder / "description", folder / "values"
    description.write_text(given.content, "utf-8", newline="")
    if given.values is None:
        return Source(description, None, "utf-8")
    values.write_text(given.values, "utf-8", newline="")
    return Source(description, values, "utf-8")


def _chosen(guessed: dict[int, str], given: AqdefIn, found: list[Content]) -> dict[int, str]:
    try:
        chosen = guessed | matching.named(given.characteristics.items(), found)
    except ValueError as error:
        raise Invalid.at("characteristics", str(error)) from None
    return actions.with_missing(chosen, found) if given.create_missing else chosen


def _result(content: Content, result: Result | None, said: str | None) -> AqdefCharacteristic:
    made = AqdefCharacteristic(
        index=content.index,
        part=content.part or content.part_name,
        number=content.number,
        name=content.name,
        notes=list(content.remarks),
    )
    if result is None:
        made.left_out = (
            content.obstacle
            or content.not_new
            or (_("characteristics says so") if said == "" else "")
            or _("nothing of its part here has its number or name; name it under characteristics")
        )
        return made
    made.characteristic, made.created, made.excluded = result.key, result.created, result.excluded
    made.notes += result.doubts
    if result.summary is not None:
        made.stored, made.repeated = result.summary.stored, result.summary.repeated
    if result.trouble is not None:
        made.trouble = " ".join([result.trouble.detail, *map(str, result.flaws[:20])])
    return made
