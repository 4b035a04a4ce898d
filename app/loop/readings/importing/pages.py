"""HTML routes: send a file, look at what it means and at what is wrong with it, import it. How it is read lies in the URL."""

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, require
from app.db.engine import Database
from app.errors import InbandError, Invalid
from app.files.formats import delimited
from app.files.formats.column_names import NAMES
from app.files.formats.delimited import ENCODINGS
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.machines import queries as machines
from app.loop.readings.aqdef import form as aqdef_form
from app.loop.readings.aqdef.actions import machine_for
from app.loop.readings.aqdef.matching import NEW, Content
from app.loop.readings.importing import drawn, uploads, wide
from app.loop.readings.importing.actions import import_readings
from app.loop.readings.importing.columns import DRAWN
from app.loop.readings.importing.history import Flawed
from app.loop.readings.importing.layout import NO_DIGIT, Layout, Wishes, refuse_incomplete
from app.loop.readings.importing.lines import look_apart, read_apart
from app.loop.readings.importing.preview import TRIED_WHOLE, Preview, PreviewLine, first_lines, preview
from app.loop.readings.importing.uploads import Upload
from app.loop.readings.importing.wide import ColumnResult
from app.web.deps import FormDep, Number, SessionDep, SettingsDep
from app.web.limits import MEGABYTE, takes
from app.web.paging import address
from app.web.templates import page

AUTOMATIC = "?"
"""The choice of a column where none is chosen and none is found."""
router = APIRouter(include_in_schema=False)
Token = Annotated[str, Path(max_length=64)]
HOW = (
    "timezone", "unit", "decimal", "delimiter", "encoding", "header_line", "first_line", "last_line", "missing", "time_format",
    "sheet", "machine",
)  # fmt: skip
SIGNS = {"tab": "\t", "comma": ",", "semicolon": ";", "bar": "|", "blanks": delimited.BLANKS}


@router.get("/import", dependencies=[require("engineer")])
def start(
    request: Request,
    session: SessionDep,
    characteristic: str = "",
    stored: Number = None,
    repeated: Number = None,
    first: Number = None,
) -> Response:
    """Choose a characteristic and a file."""
    return _start(request, session, characteristic, done=_done(session, characteristic, stored, repeated, first))


def _done(
    session: Any, characteristic: str, stored: int | None, repeated: int | None, first: int | None
) -> dict[str, Any] | None:
    if stored is None:
        return None
    if not characteristic:
        return {"to": None, "stored": stored, "repeated": repeated or 0, "first": None, "last": None}
    current = characteristics.characteristic_named(session, characteristic)
    last = first + stored - 1 if first and stored else None
    return {"to": current.characteristic, "stored": stored, "repeated": repeated or 0, "first": first, "last": last}


def _start(
    request: Request,
    session: Any,
    characteristic: str,
    *,
    refusal: InbandError | None = None,
    done: dict[str, Any] | None = None,
) -> Response:
    return page(
        request,
        "imports/start.html",
        refusal=refusal,
        choices=[
            ("", _("Several: a column for each")),
            *(
                (current.characteristic.key, f"{current.characteristic.name} · {current.machine.name}")
                for current in characteristics.characteristics(session)
            ),
        ],
        chosen=characteristic,
        done=done,
    )


@router.post("/import")
@takes(64 * MEGABYTE, by="engineer")
async def send(request: Request, session: SessionDep, caller: Engineer, settings: SettingsDep) -> Response:
    """Keep the file and go on to the preview."""
    async with request.form() as form:
        characteristic = str(form.get("characteristic") or "")
        files = [
            (each.filename, each.file)
            for each in form.getlist("file")
            if isinstance(each, UploadFile) and each.filename
        ]
        if not files:
            refusal = Invalid.at("file", _("Choose the file to import."))
            return await run_in_threadpool(_start, request, session, characteristic, refusal=refusal)
        if characteristic:
            await run_in_threadpool(characteristics.characteristic_named, session, characteristic)
        await run_in_threadpool(session.commit)  # nothing is kept open while a workbook is read
        try:
            kept = await run_in_threadpool(uploads.keep_pair, settings, caller.name, files)
        except Invalid as error:
            return await run_in_threadpool(_refused, request, characteristic, error)
        return RedirectResponse(address(f"/import/{kept.token}", characteristic=characteristic or None), 303)


def _refused(request: Request, characteristic: str, refusal: Invalid) -> Response:
    with _database(request).sessions() as session:
        return _start(request, session, characteristic, refusal=refusal)


@router.get("/import/{token}")
def look_at_it(
    request: Request,
    session: SessionDep,
    caller: Engineer,
    settings: SettingsDep,
    token: Token,
    characteristic: str = "",
) -> Response:
    """Show how the file is understood, what it would come to, what is wrong with it."""
    session.commit()  # nothing is kept open while the file is read
    return _preview(request, caller, settings, token, characteristic, request.query_params)


def _preview(
    request: Request,
    caller: Caller,
    settings: Any,
    token: str,
    characteristic: str,
    said: Mapping[str, str],
    *,
    status: int = 200,
) -> Response:
    upload = uploads.find(settings, caller.name, token, said.get("sheet", ""))
    if upload.is_aqdef:
        return _aqdef_preview(request, upload, said, characteristic, status=status)
    if not characteristic:
        return _wide_preview(request, upload, said, status=status)
    with _database(request).sessions() as session:
        current = characteristics.characteristic_named(session, characteristic)
    layout: Layout | None = None
    preview_result: Preview | None = None
    trouble: InbandError | None = None
    try:
        looked = look_apart(upload.path, _wishes(said), upload.name)
        layout = looked.layout
        layout = layout.of_one(characteristic, current.characteristic.name)
        looked = looked._replace(layout=layout)
        preview_result = preview(_database(request), characteristic, upload.path, looked)
        trouble = preview_result.trouble
    except InbandError as error:
        trouble = error
    ready = (
        preview_result is not None
        and layout is not None
        and layout.complete
        and not preview_result.flaw_count
        and trouble is None
    )
    return _page(request, upload, said, layout, trouble, status=status, to=current, found=preview_result, ready=ready)


def _aqdef_preview(
    request: Request, upload: Upload, said: Mapping[str, str], characteristic: str, *, status: int
) -> Response:
    form = aqdef_form.look(_database(request), upload, said, characteristic)
    how: dict[str, Any] = {"upload": upload, "form": form, "encodings": _encodings(), "back": "/import"}
    return page(request, "imports/aqdef.html", status=status, **how)


def _wide_preview(request: Request, upload: Upload, said: Mapping[str, str], *, status: int) -> Response:
    """The preview of a wide sheet: a characteristic for each column, guessed by its name until a person has chosen."""
    with _database(request).sessions() as session:
        known = characteristics.characteristics(session)
    layout: Layout | None = None
    trouble: InbandError | None = None
    shown: list[PreviewLine] = []
    chosen: dict[int, str] = {}
    results: list[ColumnResult] = []
    could_be_new: list[Content] = []
    cannot_be_new: list[Content] = []
    try:
        looked = look_apart(upload.path, _wishes(said), upload.name)
        layout = looked.layout
        if layout.names:
            refuse_incomplete(layout)
        if any(name.startswith("to_") for name in said):
            chosen = {column.place: column.characteristic for column in wide.columns_of(said, layout)}
        else:
            chosen = wide.columns_by_name(layout, known)
        could_be_new, cannot_be_new = drawn.missing(layout, chosen)
        if said.get("all") == "new":
            chosen |= {each.index: NEW for each in could_be_new}
            could_be_new = []
        if layout.names:
            said = {**said, "machine": _machine(request, said) or ""}
        shown = first_lines(looked)
        if chosen and upload.path.stat().st_size <= TRIED_WHOLE:
            how: dict[str, Any] = {"unit": _wishes(said).unit, "machine": said.get("machine") or None}
            results = wide.preview(_database(request), chosen, upload.path, layout, **how)
    except InbandError as error:
        trouble = error
    ready = bool(chosen) and trouble is None and all(result.trouble is None for result in results)
    return _page(
        request,
        upload,
        said,
        layout,
        trouble,
        status=status,
        to=None,
        shown=shown,
        chosen=chosen,
        results=results,
        known=known,
        could_be_new=could_be_new,
        cannot_be_new=cannot_be_new,
        machines=_machines(request) if layout and layout.names else [],
        ready=ready,
    )


def _machine(request: Request, said: Mapping[str, str]) -> str | None:
    """The machine on which missing ones are set up: the one named, or the only one."""
    with _database(request).sessions() as session:
        return machine_for(session, (), said.get("machine") or None)


def _machines(request: Request) -> list[tuple[str, str]]:
    with _database(request).sessions() as session:
        return [(each.key, each.name) for each in machines.machines(session)]


def _page(
    request: Request,
    upload: Upload,
    said: Mapping[str, str],
    layout: Layout | None,
    trouble: InbandError | None,
    **more: Any,
) -> Response:
    to: characteristics.CurrentCharacteristic | None = more["to"]
    return page(
        request,
        "imports/preview.html" if to else "imports/wide.html",
        upload=upload,
        size=upload.path.stat().st_size,
        layout=layout,
        trouble=trouble,
        said={name: said.get(name, "") for name in HOW},
        fields=_fields(layout, _wishes(said).mapping, wide=to is None) if layout else [],
        sheets=[(name, name) for name in upload.sheets],
        encodings=_encodings(),
        samples=delimited.samples(upload.path) if layout is None else [],
        back=address("/import", characteristic=to.characteristic.key if to else None),
        **more,
    )


def _encodings() -> list[tuple[str, str]]:
    return [("", _("automatic")), *((name, name) for name in ENCODINGS)]


def _wishes(said: Mapping[str, str]) -> Wishes:
    return Wishes(
        mapping={name: said[f"column_{name}"] for name in NAMES if said.get(f"column_{name}", AUTOMATIC) != AUTOMATIC},
        delimiter=SIGNS.get(said.get("delimiter", "")),
        decimal={"comma": ",", "point": "."}.get(said.get("decimal", "")),
        unit=said.get("unit") or None,
        timezone=said.get("timezone", "").strip() or plant_zone().key,
        time_format=said.get("time_format", "").strip() or None,
        encoding=said.get("encoding") or None,
        header_line=_line(said.get("header_line", "")),
        first_line=_line(said.get("first_line", "")),
        last_line=_line(said.get("last_line", "")),
        missing=frozenset({NO_DIGIT} if said.get("missing") else ()),
    )


def _line(text: str) -> int | None:
    """The number of a line; None for what is none."""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 7 else None


def _fields(layout: Layout, chosen: Mapping[str, str], *, wide: bool = False) -> list[dict[str, Any]]:
    """Each field that a column can be, with the columns to choose from and the one that it is. chosen: columns by person, by field.

    Where nothing is found and nobody has chosen, it is looked for again when the line of the heading is another; of times that are
    in doubt a person says that there are none.
    """
    labels = {
        "measured": _("Measured value"),
        "measured_at": _("Time of measuring"),
        "machined_at": _("Time of cutting"),
        "part": _("Part"),
        "unit": _("Unit"),
        "characteristic": _("Characteristic"),
        "nominal": _("Nominal size"),
        "upper": _("Upper limit"),
        "lower": _("Lower limit"),
        "natural_limit": _("Natural limit"),
        "key": _("Key"),
    }
    columns = [(str(at), name or _("Column {n}").format(n=at)) for at, name in enumerate(layout.header, start=1)]
    fields: list[dict[str, Any]] = []
    for name, label in labels.items():
        if wide and name in {"measured", "key"} and not layout.names:
            continue
        if name in DRAWN and not (wide and layout.names):
            continue
        places = layout.columns.get(name, ())
        value = "+".join(str(place + 1) for place in places)
        pair = [(value, layout.named(name))] if len(places) > 1 else []
        none, free = [("", "–")], columns
        if not value and name not in chosen:
            value = AUTOMATIC
            none = [(AUTOMATIC, "–"), *([("", _("none"))] if name in dict(layout.questions) else [])]
        elif layout.takes_times and name == "measured_at":
            free = [(AUTOMATIC if at == value else at, shown) for at, shown in columns]
            value = AUTOMATIC
        options = [*none, *pair, *free]
        fields.append({"name": f"column_{name}", "label": label, "value": value, "options": options})
    return fields


def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


@router.post("/import/{token}")
def import_it(
    request: Request, session: SessionDep, caller: Engineer, settings: SettingsDep, token: Token, form: FormDep
) -> Response:
    """All of it or nothing; what is wrong is shown where it was to be seen before."""
    characteristic = form.get("characteristic", "")
    upload = uploads.find(settings, caller.name, token, form.get("sheet", ""))
    session.commit()  # the import has a transaction of its own, and takes a while
    if upload.is_aqdef:
        return _import_aqdef(request, caller, upload, form, characteristic)
    try:
        layout = look_apart(upload.path, _wishes(form), upload.name).layout
        if not characteristic:
            return _import_wide(request, caller, upload, layout, form)
        refuse_incomplete(layout)
        with _database(request).sessions() as own:
            current = characteristics.characteristic_named(own, characteristic)
        layout = layout.of_one(characteristic, current.characteristic.name)
        with read_apart(upload.path, [layout]) as read:
            summary = import_readings(
                _database(request),
                characteristic,
                upload.path,
                layout,
                actor=caller.name,
                source=upload.name,
                read=read,
            )
    except InbandError as error:
        if characteristic and not isinstance(error, Flawed):
            raise
        return _preview(request, caller, settings, token, characteristic, form, status=error.status)
    uploads.forget(upload)
    outcome = {"characteristic": characteristic, "stored": summary.stored, "repeated": summary.repeated}
    if summary.first_sequence is not None:
        outcome["first"] = summary.first_sequence
    return RedirectResponse(address("/import", **outcome), 303)


def _import_aqdef(
    request: Request, caller: Caller, upload: Upload, form: Mapping[str, str], characteristic: str
) -> Response:
    try:
        outcome = aqdef_form.store(_database(request), upload, form, caller.name)
    except InbandError as error:
        return _aqdef_preview(request, upload, form, characteristic, status=error.status)
    uploads.forget(upload)
    return RedirectResponse(address("/import", stored=outcome.stored, repeated=outcome.repeated), 303)


def _import_wide(
    request: Request, caller: Caller, upload: Upload, layout: Layout, form: Mapping[str, str]
) -> RedirectResponse:
    results = wide.import_apart(
        _database(request),
        wide.columns_of(form, layout),
        upload.path,
        layout,
        unit=_wishes(form).unit,
        machine=form.get("machine") or None,
        actor=caller.name,
        source=upload.name,
    )
    uploads.forget(upload)
    summaries = [result.summary for result in results if result.summary is not None]
    stored, repeated = sum(each.stored for each in summaries), sum(each.repeated for each in summaries)
    return RedirectResponse(address("/import", stored=stored, repeated=repeated, columns=len(results)), 303)
