"""The page of an AQDEF file: what is chosen in it, and what each characteristic would come to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from app.db.engine import Database
from app.errors import InbandError
from app.files.aqdef.description import Description, Source
from app.files.formats import cell_values
from app.files.formats.cell_values import DayOrder, Unreadable
from app.files.formats.delimited import ENCODINGS
from app.files.formats.units import LENGTHS
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.machines import queries as machines
from app.loop.readings.aqdef import actions, matching
from app.loop.readings.aqdef.actions import Outcome, Result
from app.loop.readings.aqdef.matching import NEW, Content
from app.loop.readings.aqdef.sorting import Wishes
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.history import Flawed
from app.loop.readings.importing.preview import CHECKED_LINES, TRIED_WHOLE
from app.loop.readings.importing.refusals import wrong
from app.loop.readings.importing.uploads import Upload

HOW = ("timezone", "unit", "dates", "encoding", "machine")


@dataclass
class Form:
    """The preview. checked: the number of values that were looked at, None for all."""

    said: dict[str, str]
    description: Description | None = None
    found: list[Content] = field(default_factory=list)
    chosen: dict[int, str] = field(default_factory=dict)
    outcome: Outcome | None = None
    trouble: InbandError | None = None
    checked: int | None = None
    machines: list[tuple[str, str]] = field(default_factory=list)
    known: list[tuple[str, str]] = field(default_factory=list)

    @cached_property
    def _results(self) -> dict[int, Result]:
        return {each.content.index: each for each in (self.outcome.results if self.outcome else [])}

    def result(self, index: int) -> Result | None:
        """The result of one characteristic."""
        return self._results.get(index)

    @property
    def flaws(self) -> list[Flaw]:
        """Lines that are wrong."""
        return self.trouble.flaws if isinstance(self.trouble, Flawed) else []

    @property
    def ready(self) -> bool:
        """Tell if it can be imported as it is."""
        results = self.outcome.results if self.outcome else []
        return bool(self.chosen) and self.trouble is None and all(each.trouble is None for each in results)

    @property
    def could_be_new(self) -> list[Content]:
        """Those that are not chosen and that can be set up."""
        return [each for each in self.found if each.index not in self.chosen and not each.obstacle and not each.not_new]


def look(database: Database, upload: Upload, said: Mapping[str, str], characteristic: str) -> Form:
    """Look at the file as the import will, and store nothing. characteristic: chosen before, for a file with only one."""
    form = Form({name: said.get(name, "") for name in HOW})
    with database.sessions() as session:
        form.known = [
            (each.characteristic.key, f"{each.characteristic.name} · {each.machine.name}")
            for each in characteristics.characteristics(session)
        ]
        form.machines = [(each.key, each.name) for each in machines.machines(session)]
    try:
        source, wishes = _source(upload, said), _wishes(said)
        form.description = description = actions.describe(source, foreign=True)
        form.found = matching.contents(description, wishes.unit)
        with database.sessions() as session:
            form.chosen = _chosen(said) if _has_choice(said) else actions.guess(session, form.found)
            form.said["machine"] = actions.machine_for(session, form.found, said.get("machine") or None) or ""
        lengths = [each for each in form.found if not each.obstacle]
        if characteristic and not _has_choice(said) and len(lengths) == 1:
            form.chosen = {lengths[0].index: characteristic}
        if said.get("all") == "new":
            form.chosen |= {each.index: NEW for each in form.could_be_new}
        if form.chosen:
            large = (
                upload.path.stat().st_size > TRIED_WHOLE or (upload.values or upload.path).stat().st_size > TRIED_WHOLE
            )
            form.checked = CHECKED_LINES if large else None
            form.outcome = actions.import_aqdef(
                database,
                source,
                description,
                form.chosen,
                wishes,
                machine=form.said["machine"] or None,
                actor="",
                name=upload.name,
                dry_run=True,
                most=form.checked,
                foreign=True,
            )
    except InbandError as error:
        form.trouble = error
    return form


def store(database: Database, upload: Upload, said: Mapping[str, str], actor: str) -> Outcome:
    """Import what is chosen. Raises `InbandError`."""
    source = _source(upload, said)
    description = actions.describe(source, foreign=True)
    return actions.import_aqdef(
        database,
        source,
        description,
        _chosen(said),
        _wishes(said),
        machine=said.get("machine") or None,
        actor=actor,
        name=upload.name,
        foreign=True,
    )


def _source(upload: Upload, said: Mapping[str, str]) -> Source:
    encoding = said.get("encoding") or None
    if encoding not in {None, *ENCODINGS}:
        raise wrong("encoding", encoding or "")
    return Source(upload.path, upload.values, encoding)


def _wishes(said: Mapping[str, str]) -> Wishes:
    try:
        zone = cell_values.zone_named(said.get("timezone", "").strip() or plant_zone().key)
    except Unreadable as error:
        raise wrong("timezone", str(error)) from None
    unit = said.get("unit", "")
    dates = said.get("dates", "")
    orders: dict[str, DayOrder] = {"day_first": "day_first", "month_first": "month_first"}
    return Wishes(zone, orders.get(dates), unit if unit in LENGTHS else None)


def _has_choice(said: Mapping[str, str]) -> bool:
    return any(name.startswith("to_") for name in said)


def _chosen(said: Mapping[str, str]) -> dict[int, str]:
    pairs = ((name.removeprefix("to_"), key.strip()) for name, key in said.items() if name.startswith("to_"))
    return {int(index): key for index, key in pairs if key and index.isascii() and index.isdigit() and len(index) < 7}
