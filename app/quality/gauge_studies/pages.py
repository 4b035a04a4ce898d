"""Pages: the list of gauge studies, a new one, one of them, and one put right."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Engineer, Operator, Viewer
from app.core.spc.refusal import Refused
from app.errors import Conflict, FieldError, InbandError, Invalid, NotFound
from app.language.formatting import as_typed
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.machines import queries as machines
from app.loop.warnings.wording import sentence
from app.quality.gauge_studies import actions, form_reader, labels, queries, wording
from app.quality.gauge_studies.form_reader import Grid
from app.quality.gauge_studies.queries import Advice, StudyRow
from app.quality.gauge_studies.schemas import CorrectionIn, StudyIn
from app.quality.gauge_studies.tables import KINDS
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web import forms
from app.web.deps import Before, FormDep, SessionDep, Sought
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 25


def _failing() -> dict[str, Any]:
    failing = proof.failing()
    return {"proof_failing": failing, "proof_warning": proof_wording.warning(len(failing))}


@router.get("/gauges")
def list_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: Annotated[str, Query(max_length=64)] = "",
    characteristic: Annotated[str, Query(max_length=64)] = "",
    q: Sought = "",
    before: Before = None,
) -> Response:
    """Every study with its verdict, newest first; of a machine, or of a characteristic with what they say about its R33."""
    current = characteristics.characteristic_named(session, characteristic) if characteristic else None
    chosen = current.machine if current else machines.find_machine(session, machine)
    rows = queries.studies(
        session,
        machine_id=chosen.id if chosen else None,
        characteristic_id=current.characteristic.id if current else None,
        kinds={each: wording.kind(each) for each in KINDS},
        holding=q,
        before=before,
        limit=ON_PAGE + 1,
    )
    return page(
        request,
        "gauge_studies/list.html",
        part=part_of(
            rows,
            ON_PAGE,
            before,
            lambda row: row.study.id,
            partial(address, "/gauges", machine=machine or None, characteristic=characteristic or None, q=q or None),
        ),
        q=q,
        machine=chosen,
        current=current,
        about=queries.latest_advice(session, current) if current else None,
        machines=machines.machines(session),
        may_change=caller.may("engineer"),
        may_enter=caller.may("operator"),
        wording=wording,
        **_failing(),
    )


@router.get("/gauges/new")
def new_page(
    request: Request,
    session: SessionDep,
    _caller: Operator,
    kind: Annotated[str, Query(max_length=20)] = "",
    machine: Annotated[str, Query(max_length=64)] = "",
    characteristic: Annotated[str, Query(max_length=64)] = "",
) -> Response:
    """Choose a kind, then its form with an empty grid."""
    if kind not in KINDS:
        return page(
            request, "gauge_studies/kinds.html", kinds=wording.kinds(), machine=machine, characteristic=characteristic
        )
    typed = _of_characteristic(session, kind, {"machine": machine, "characteristic": characteristic})
    return _form(request, session, kind, typed, form_reader.shape(kind, typed))


def _of_characteristic(session: Session, kind: str, typed: Mapping[str, str]) -> dict[str, str]:
    """The form with the machine of the chosen characteristic, and where they are empty its tolerance and target.

    The target is a suggestion for the true size, to be seen before the study is stored: what is stored now gets none.
    """
    key = typed.get("characteristic", "").strip()
    if not key:
        return dict(typed)
    current = characteristics.characteristic_named(session, key)
    suggested = {"tolerance": as_typed(current.parameters.tolerance_width)}
    if kind in {"type_one", "bias"} and typed.get("do") != "store":
        suggested["reference"] = as_typed(current.parameters.target)
    said = {name: text for name, text in typed.items() if text.strip()}
    return dict(typed) | suggested | said | {"machine": current.machine.key}


@router.post("/gauges/new")
def send_new(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """`do`: another grid, a pasted table, readings put into the grid, or the study as it is."""
    kind, typed = form.get("kind", ""), dict(form)
    if kind not in KINDS:
        raise NotFound(_("There is no such kind of gauge study."), _("Choose one on the page “New gauge study”."))
    try:
        typed = _of_characteristic(session, kind, typed)
        with session.begin_nested():
            filled = _filled(session, kind, typed)
            if filled is not None:
                return _form(request, session, kind, *filled)
            rows = form_reader.rows_of(kind, form_reader.stored_grid(kind, typed))
            study = forms.typed(StudyIn, typed, kind=kind, rows=rows)
            machine = machines.machine_named(session, study.machine or "")
            source = _source(session, kind, typed, study)
            result = actions.add_study(session, machine, study, caller, source)
    except InbandError as error:
        if not error.errors and error.status != NotFound.status:
            raise
        return _form(request, session, kind, typed, _grid_or_none(kind, typed), error=error)
    return RedirectResponse(f"/gauges/{result.row.study.id}?done=entered", 303)


def _filled(session: Session, kind: str, typed: dict[str, str]) -> tuple[dict[str, str], Grid] | None:
    """The form again with another grid; None when the study is to be stored."""
    match typed.get("do"):
        case "grid":
            return typed, form_reader.shape(kind, typed)
        case "paste":
            return form_reader.pasted_grid(kind, typed)
        case "readings":
            return _from_readings(session, kind, typed)
    return None


def _from_readings(session: Session, kind: str, typed: dict[str, str]) -> tuple[dict[str, str], Grid]:
    key, take = typed.get("characteristic", ""), typed.get("take", "readings")
    if not key:
        words = _("name the characteristic whose readings are to be taken")
        raise Invalid(words, errors=[FieldError("characteristic", words)])
    current = characteristics.characteristic_named(session, key)
    first, through = (form_reader.whole(typed, name) for name in ("first", "through"))
    rows = actions.rows_from_readings(session, current, kind, first, through, take)
    fields, grid = form_reader.grid_of(kind, rows)
    unit = "touch" if take == "touches" else "reading"
    return typed | fields | {"machine": current.machine.key, "each": unit, "from": f"{first}-{through}-{take}"}, grid


def _source(session: Session, kind: str, typed: Mapping[str, str], given: StudyIn) -> dict[str, Any] | None:
    """From which readings the grid was filled, if it was, and still holds what they say."""
    first, _dash, rest = typed.get("from", "").partition("-")
    through, _dash, take = rest.partition("-")
    if not given.characteristic or take not in {"readings", "touches"} or len(typed["from"]) > 60:
        return None
    current = characteristics.characteristic_named(session, given.characteristic)
    try:
        numbers = form_reader.whole({"first": first}, "first"), form_reader.whole({"through": through}, "through")
        rows = actions.rows_from_readings(session, current, kind, *numbers, take)
    except Invalid:
        return None
    values = [[round(value, 9) for value in row["values"]] for row in rows]
    if values != [[round(value, 9) for value in row.values] for row in given.rows]:
        return None  # a person has typed over it
    return actions.source_of(session, current, *numbers, take)


def _grid_or_none(kind: str, typed: Mapping[str, str]) -> Grid | None:
    try:
        return form_reader.typed_grid(kind, typed)
    except Invalid:
        return None


def _form(
    request: Request,
    session: Session,
    kind: str,
    typed: Mapping[str, str],
    grid: Grid | None,
    *,
    error: InbandError | None = None,
    study: StudyRow | None = None,
) -> Response:
    begun = form_reader.begun(kind, typed)
    usable = characteristics.characteristics(session)
    return page(
        request,
        "gauge_studies/form.html",
        refusal=error,
        kind=kind,
        typed=begun,
        grid=grid or form_reader.shape(kind, {}),
        study=study,
        machines=[(machine.key, machine.name) for machine in machines.machines(session)],
        characteristics=[("", _("none"))]
        + [
            (row.characteristic.key, f"{row.characteristic.key} – {row.characteristic.name}, {row.machine.name}")
            for row in usable
        ],
        machine_of={row.characteristic.key: row.machine.key for row in usable},
        heading=form_reader.heading,
        wording=wording,
    )


@router.get("/gauges/{number}")
def study_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    number: int,
    revision: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    done: Annotated[str, Query(max_length=20)] = "",
) -> Response:
    """Verdicts, charts, table of variance, values, and what the study suggests for R33."""
    row = queries.study(session, number, revision)
    advice = queries.advice(session, row)
    return page(
        request,
        "gauge_studies/study.html",
        row=row,
        found=row.evaluation,
        advice=advice if isinstance(advice, Advice) else None,
        verdicts=wording.verdicts(row.evaluation, row.tolerance),
        warnings=[sentence(warning) for warning in row.warnings],
        grid=form_reader.even(form_reader.grid_of(row.study.kind, row.revision.rows)[1]),
        heading=form_reader.heading,
        revisions=queries.revisions(session, row),
        refused=lambda value: isinstance(value, Refused),
        components=labels.components,
        done={"entered": _("The study is stored."), "corrected": _("The study is corrected; the previous revision is kept.")}.get(done),
        figure=lambda picture: f"/api/v1/gauge-studies/{number}/figure?picture={picture}" + (f"&revision={revision}" if revision else ""),
        may_correct=caller.may("engineer"),
        wording=wording,
        **_failing(),
    )  # fmt: skip


@router.get("/gauges/{number}/correct")
def correct_page(request: Request, session: SessionDep, _caller: Engineer, number: int) -> Response:
    """The form with everything that is stored in it."""
    row = queries.study(session, number)
    fields, grid = form_reader.grid_of(row.study.kind, row.revision.rows)
    typed = form_reader.typed_settings(row.settings) | fields | _named(row) | {"seen_revision": str(row.newest)}
    return _form(request, session, row.study.kind, typed, grid, study=row)


def _named(row: StudyRow) -> dict[str, str]:
    return {"machine": row.machine.key, "characteristic": row.characteristic or ""}


@router.post("/gauges/{number}/correct")
def send_correction(request: Request, session: SessionDep, caller: Engineer, number: int, form: FormDep) -> Response:
    """A new revision, with the reason; or another grid, as for a new study."""
    row = queries.study(session, number)
    kind, typed = row.study.kind, dict(form) | _named(row)
    try:
        with session.begin_nested():
            filled = _filled(session, kind, typed)
            if filled is not None:
                return _form(request, session, kind, *filled, study=row)
            rows = form_reader.rows_of(kind, form_reader.stored_grid(kind, typed))
            actions.correct_study(session, number, forms.typed(CorrectionIn, typed, rows=rows), caller)
    except InbandError as error:
        if not error.errors:
            raise
        if isinstance(error, Conflict):  # who was informed may store it all the same
            typed |= {"seen_revision": str(queries.study(session, number).newest)}
        return _form(request, session, kind, typed, _grid_or_none(kind, typed), error=error, study=row)
    return RedirectResponse(f"/gauges/{number}?done=corrected", 303)
