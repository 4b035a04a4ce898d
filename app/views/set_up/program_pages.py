"""Set-up pages: a program text becomes a characteristic, and a characteristic becomes program text."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, get_args
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile

from app.access.deps import Caller, Viewer
from app.core.parameters import BY_NAME, LARGEST_LENGTH
from app.core.programs import fanuc
from app.core.programs.heidenhain import OF_SAVING, PARAMETERS
from app.core.programs.lines import MOST_CHARACTERS, WARNINGS, LineVerdict, Program, ProgramKind
from app.core.programs.ring_settings import HIGHEST_OF_ALL, MOST_CHARACTERISTICS, WEARS
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics import actions, queries
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.wording import in_order, label, worded
from app.loop.machines.queries import find_machine, machines
from app.loop.programs import queries as programs
from app.loop.programs import ring_queries, wording
from app.loop.programs.queries import READABLE, CheckedProgram
from app.views.set_up import characteristic_pages, parameter_form
from app.views.set_up.frame import setup_page
from app.web.deps import SessionDep, texts
from app.web.forms import by_field

router = APIRouter(include_in_schema=False)
VERDICTS = tuple(verdict.value for verdict in (LineVerdict.NOT_UNDERSTOOD, LineVerdict.UNDERSTOOD, LineVerdict.IGNORED))


@router.get("/setup/programs")
def programs_page(request: Request, session: SessionDep, caller: Viewer, characteristic: str = "") -> Response:
    """Paste a text or choose a file."""
    return _page(request, session, caller, {"characteristic": characteristic})


@router.post("/setup/programs")
async def send_program(request: Request, session: SessionDep, caller: Viewer) -> Response:
    """Show how the text was understood, or go on to the form of a characteristic with it. Nothing is stored here."""
    form = await request.form(max_files=1, max_fields=50)
    typed = dict(texts(form))
    file = form.get("file")
    if isinstance(file, UploadFile) and file.filename:
        typed["text"] = programs.decoded(await file.read(4 * MOST_CHARACTERS + 4))
    return await run_in_threadpool(_sent, request, session, caller, typed)


def _sent(request: Request, session: Session, caller: Caller, typed: dict[str, str]) -> Response:
    control = typed.get("control")
    try:
        examined = programs.check(
            typed.get("text", ""),
            control if control in READABLE else None,  # type: ignore[arg-type]
            find_machine(session, typed.get("machine", "")),
        )
    except Invalid as error:
        return _page(request, session, caller, typed, refusal=error)
    do = typed.get("do", "")
    if do in {"create", "change"} and examined.program is not None and examined.makes_a_characteristic:
        caller.must("engineer")
        if do == "create":
            return characteristic_pages.prefilled_new(request, session, caller, _typed_new(session, examined.program))
        key = typed.get("characteristic", "")
        current = queries.characteristic_named(session, key)
        merged = actions.merged(current.version.parameters, examined.program.parameters)
        return characteristic_pages.prefilled_change(
            request, session, caller, current, parameter_form.typed_partly(merged) | {"reason": _("From program text")}
        )
    return _page(request, session, caller, typed, examined)


def _typed_new(session: Session, program: Program) -> dict[str, str]:
    about = program.about
    typed = parameter_form.typed_partly(program.parameters)
    key = about.get("characteristic", "")
    free = bool(key) and not queries.key_is_taken(session, key)
    return typed | {"key": key if free else "", "name": about.get("name", ""), "part": about.get("part", "")}


def _page(
    request: Request,
    session: Session,
    caller: Caller,
    typed: Mapping[str, str],
    examined: CheckedProgram | None = None,
    *,
    refusal: Invalid | None = None,
) -> Response:
    program = examined.program if examined else None
    fields = {"text": "", "control": examined.control if examined else "", "characteristic": "", "machine": ""} | dict(
        typed
    )
    if program and not fields["characteristic"]:
        fields["characteristic"] = program.about.get("characteristic", "")
    judging = examined is not None and examined.makes_a_characteristic
    parameters = program.parameters if program is not None else {}
    return setup_page(
        request,
        "programs.html",
        caller,
        "programs",
        refusal=refusal,
        typed=fields,
        controls=[("", _("automatic")), ("sinumerik", "Sinumerik"), ("fanuc", "Fanuc"), ("heidenhain", "Heidenhain")],
        plan=_plan_address(program),
        work_zero=_work_zero_address(program),
        examined=examined,
        touches=fanuc.touches(program.results) if program else None,
        warned=WARNINGS,
        program=program,
        judging=judging,
        parameters=_rows(parameters),
        counts=_counts(examined) if examined else [],
        wording=wording,
        characteristics=[
            (row.characteristic.key, f"{row.characteristic.name} · {row.machine.name}")
            for row in queries.characteristics(session)
        ],
        machines=[("", _("not said"))] + [(row.key, row.name) for row in machines(session)],
        longest=MOST_CHARACTERS,
        diagram=parameter_form.diagram(parameter_form.typed_partly(parameters)) if judging else None,
        sentences=[],
        one_sided=[],
        short=parameter_form.short_limit,
    )


def _rows(parameters: Mapping[str, Any]) -> list[tuple[str | None, str, str]]:
    """R number, name and value of each parameter, those of a calibration too."""
    zero = {
        "work_offset": _("Work offset"),
        "axes": _("Axes set"),
        "tip": _("Diameter of the tip"),
        "feeler": _("Feeler"),
        "old_kept": _("Old offset kept in"),
    }
    own = {"gauge": ("R32", _("Size of the gauge")), "surface": ("R21", _("Surface")), "probe": ("R22", _("Probe"))}
    words = {
        "free": _("free surface"),
        "groove": _("reference groove"),
        "axial": _("axial"),
        "radial": _("radial"),
    }
    rows: list[tuple[str | None, str, str]] = []
    ordered = in_order(parameters) | dict(parameters)
    for name, value in ordered.items():
        if name in zero:
            rows.append((None, zero[name], f"{value:g} mm" if name in {"tip", "feeler"} else str(value)))
        elif name == "cycle" or name in PARAMETERS or name in OF_SAVING:
            rows.append((None if name == "cycle" else name, wording.q_name(name), wording.q_value(name, value)))
        elif name in own:
            text = words.get(str(value)) or f"{value:.10g} mm"
            rows.append((*own[name], text))
        else:
            field = BY_NAME.get(name)
            rows.append((field.r if field else None, label(name), worded(name, parameters)))
    return rows


def _work_zero_address(program: Program | None) -> str | None:
    """The form of a work zero with what an edge finder's macro says: work offset, tip, feeler."""
    if program is None or program.kind is not ProgramKind.WORK_ZERO:
        return None
    query = {
        name: f"{value:g}" if isinstance(value, float) else str(value)
        for name, value in program.parameters.items()
        if name in {"work_offset", "tip", "feeler"}
    }
    return f"/work-zeros/new?{urlencode(query)}"


def _plan_address(program: Program | None) -> str | None:
    """The measuring plan that a kinematics cycle says, to be looked at and changed."""
    if program is None or program.kind is not ProgramKind.KINEMATICS or program.parameters.get("cycle") == 450:
        return None
    return f"/kinematics/measuring-plan?{urlencode(program.parameters)}"


def _counts(examined: CheckedProgram) -> list[tuple[str, str, int]]:
    verdicts = [line.verdict.value for line in examined.text.lines]
    return [(verdict, wording.verdict_word(verdict), verdicts.count(verdict)) for verdict in VERDICTS]


# --- written


@router.get("/setup/characteristics/{characteristic}/program")
def program_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: str,
    control: Annotated[str | None, Query(max_length=40)] = None,
    kind: Annotated[str, Query(max_length=40)] = "measuring",
    gauge: Annotated[str, Query(max_length=40)] = "",
    surface: Annotated[str, Query(max_length=40)] = "free",
    probe: Annotated[str, Query(max_length=40)] = "axial",
) -> Response:
    """The measuring or calibration program of a characteristic, or those for the bridge, to copy and download."""
    current = queries.characteristic_named(session, characteristic)
    if kind == "ring":
        return _ring_page(request, current, caller, control)
    chosen = control if control in programs.WRITTEN else current.machine.control
    if chosen not in programs.WRITTEN:
        chosen = programs.WRITTEN[0]
    kind = kind if kind in get_args(programs.Kind) else "measuring"
    options = {"surface": surface if surface == "groove" else "free", "probe": probe if probe == "radial" else "axial"}
    size, wrong = _gauge(gauge)
    text = programs.program_of(current, chosen, kind, gauge=size, **options)  # type: ignore[arg-type]
    download_query = {"control": chosen, "kind": kind}
    if kind == "calibration":
        download_query |= options | ({"gauge": gauge} if size is not None else {})
    return setup_page(
        request,
        "program.html",
        caller,
        "characteristics",
        current=current,
        text=text,
        control=chosen,
        kind=kind,
        options=options,
        gauge=gauge,
        errors={"gauge": wrong} if wrong else {},
        controls=[("sinumerik", "Sinumerik"), ("fanuc", "Fanuc")],
        download=f"/api/v1/characteristics/{current.characteristic.key}/program?{urlencode(download_query)}",
        file=programs.file_name(current, chosen, kind),  # type: ignore[arg-type]
        address=lambda **query: f"/setup/characteristics/{current.characteristic.key}/program?{urlencode(query)}",
    )


def _ring_page(request: Request, current: CurrentCharacteristic, caller: Caller, control: str | None) -> Response:
    """The programs that send readings to the bridge and take corrections from it."""
    query = request.query_params
    usual = current.machine.control if current.machine.control in ring_queries.RING_CONTROLS else "sinumerik"
    chosen = ring_queries.ring_control(current, control if control in ring_queries.RING_CONTROLS else usual)
    typed = {name: query.get(name, "")[:40] for name in RING_FIELDS}
    errors: dict[str, str] = {}
    given: dict[str, float] = {}
    for name, (lowest, highest, whole) in RING_FIELDS.items():
        value = parameter_form.number(typed[name])
        if value is None:
            continue
        if isinstance(value, str) or not lowest <= value <= highest or (whole and value != int(value)):
            errors[name] = _("Must be a number from {lowest} to {highest}").format(lowest=lowest, highest=highest)
        else:
            given[name] = int(value) if whole else float(value)
    measured, go_on = query.get("measured", "")[:40].strip(), query.get("go_on") == "true"
    if measured and not re.fullmatch(ring_queries.SIZE_WORD, measured):
        errors["measured"] = _("Must be a variable of the control, such as #510 or R43")
        measured = ""
    places = [offsets for control_of, offsets in WEARS if control_of is chosen]
    offsets = next((place for place in places if place == query.get("offsets")), None)
    try:
        settings = ring_queries.ring_settings(current, chosen, offsets=offsets, measured=measured, go_on=go_on, **given)  # type: ignore[arg-type]
    except Invalid as error:
        errors |= by_field(error)
        settings = ring_queries.ring_settings(current, chosen)
        given, measured = {}, ""
    said: dict[str, object] = {**given, "offsets": settings.offsets.value}
    if measured:
        said["measured"] = measured
    if go_on:
        said["go_on"] = "true"
    address = f"/api/v1/characteristics/{current.characteristic.key}/program"
    return setup_page(
        request,
        "ring_programs.html",
        caller,
        "characteristics",
        current=current,
        control=chosen.value,
        controls=[("sinumerik", "Sinumerik"), ("fanuc", "Fanuc"), ("haas", "Haas")],
        typed=typed | {"measured": query.get("measured", "")[:40]},
        go_on=go_on,
        places=[(place.value, ring_queries.offsets_word(place)) for place in places],
        errors=errors,
        settings=settings,
        texts=[] if errors else ring_queries.ring_texts(current, settings),
        word=ring_queries.ring_word,
        download=lambda part: f"{address}?{urlencode({'ring': part, 'control': chosen.value} | said)}",
        address=lambda **query: f"/setup/characteristics/{current.characteristic.key}/program?{urlencode(query)}",
    )


RING_FIELDS: dict[str, tuple[float, float, bool]] = {
    "number": (1, MOST_CHARACTERISTICS, True),
    "first_register": (0, HIGHEST_OF_ALL, True),
    "time_out": (1, 3600, False),
    "decision_time": (0, 600, False),
    "largest_step": (0.001, 10, False),
}
"""Fields of the form: lowest and highest value, and whether it is whole."""


def _gauge(text: str) -> tuple[float | None, str | None]:
    """The size that was typed, or what is wrong with it."""
    value = parameter_form.number(text)
    if value is None:
        return None, None
    if isinstance(value, str) or not 0 < value <= LARGEST_LENGTH:
        return None, _("Must be a size in mm, such as 199.852")
    return float(value), None
