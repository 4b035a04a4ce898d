"""Pages: every feature whose form was measured, the trend of one, a new measurement, one measurement."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Operator, Viewer, require
from app.core.geometry.relations import ENGINE
from app.errors import InbandError, Invalid, NotFound
from app.geometry.geometric_form import actions, form_reader, queries, wording
from app.geometry.geometric_form.evaluation import warnings_of
from app.geometry.geometric_form.schemas import FormIn
from app.language.i18n import _
from app.loop.machines.queries import machine_named, machines
from app.loop.warnings.wording import sentence
from app.web.deps import FormDep, Number, SessionDep, Word
from app.web.forms import by_field, parsed
from app.web.paging import address, part_of
from app.web.templates import page

router = APIRouter(include_in_schema=False)
ON_PAGE = 25
EXAMPLE = "printed"
PRINTED = {
    "kind": "axis_straightness",
    "method": "printed",
    "tolerance": "5",
    "tip_diameter": "6",
    "side": "inside",
    "touches": "-6.096 24.249\n22.578 10.784\n12.465 -21.678\n\n23.99 -7.346\n20.880 13.749\n-23.388 8.859\n\n"
    "5.675 24.341\n-24.71 -3.748\n23.78 -7.699\n\n-12.55 21.611\n-6.82 -24.059\n23.699 7.911",
}
# Where the form shows what is wrong with the parts of a measurement.
FIELDS = (
    *(
        "machine",
        "feature",
        "kind",
        "method",
        "tolerance",
        "repeatability",
        "part",
        "characteristic",
        "touches",
        "side",
    ),
    *("tip_diameter", "datum", "length", "nominal_x", "nominal_y"),
)
SHOWN_AT = {"sections": "touches", "points": "touches", "nominal": "nominal_x"}


@router.get("/forms", dependencies=[require("viewer")])
def overview(request: Request, session: SessionDep, machine: Word = None) -> Response:
    """Every feature with its newest result."""
    chosen = machine_named(session, machine) if machine else None
    return page(
        request,
        "geometric_form/overview.html",
        features=queries.features(session, chosen.id if chosen else None),
        machine=chosen,
        machines=machines(session),
        wording=wording,
        trend=trend_url,
    )


def trend_url(machine: str, feature: str, kind: str, **query: Any) -> str:
    """The page of a feature."""
    return address(f"/forms/features/{machine}/{feature}", kind=kind, **query)


@router.get("/forms/features/{machine}/{feature}", dependencies=[require("viewer")])
def feature_page(
    request: Request, session: SessionDep, machine: str, feature: str, kind: Word = None, before: Number = None
) -> Response:
    """The trend of a feature, and its measurements, newest first."""
    machine_row = machine_named(session, machine)
    rows = queries.forms(
        session,
        machine_id=machine_row.id,
        feature=feature,
        kind=kind,
        before=before,
        newest_first=True,
        limit=ON_PAGE + 1,
    )
    if not rows and before is None:
        raise NotFound(
            _("There is no form measurement of the feature {feature} on this machine.").format(
                feature=repr(feature[:64])
            ),
            _("Forms lists every feature."),
        )
    shown_kind = kind or rows[0].measurement.kind if rows else kind or ""
    link = partial(trend_url, machine, feature, shown_kind)
    part = part_of(rows, ON_PAGE, before, lambda row: row.measurement.id, link)
    return page(
        request,
        "geometric_form/feature.html",
        machine=machine_row,
        feature=feature,
        kind=shown_kind,
        part=part,
        became=queries.became(session, part.rows),
        wording=wording,
    )


@router.get("/forms/new", dependencies=[require("operator")])
def new_page(
    request: Request,
    session: SessionDep,
    from_: Annotated[int | None, Query(alias="from", ge=1)] = None,
    example: Word = None,
    machine: Word = None,
    kind: Word = None,
) -> Response:
    """The form for a new measurement; filled in like another one, or with the published example."""
    filled: dict[str, Any] = {"machine": machine or "", "kind": kind or "roundness"}
    if from_ is not None:
        filled = _like(queries.form(session, from_))
    elif example == EXAMPLE:
        filled |= PRINTED
    return _new(request, session, filled)


def _like(row: queries.FormRow) -> dict[str, Any]:
    measurement = row.measurement
    inputs, datum = measurement.given, measurement.given.get("datum") or {}
    nominal = inputs.get("nominal") or [None, None]
    return {
        "machine": row.machine,
        "feature": measurement.feature,
        "kind": measurement.kind,
        "method": measurement.method,
        "part": measurement.part,
        "tolerance": None if measurement.tolerance is None else f"{measurement.tolerance * 1000:g}",
        "repeatability": None if measurement.repeatability is None else f"{measurement.repeatability * 1000:g}",
        "tip_diameter": inputs.get("tip_diameter"),
        "side": inputs.get("side"),
        "length": inputs.get("length"),
        "nominal_x": nominal[0],
        "nominal_y": nominal[1],
        "touches": form_reader.written(inputs),
        "datum": form_reader.written(datum),
        "feature_as": "plane" if inputs.get("points") else "axis",
        "datum_as": "plane" if datum.get("points") else "axis",
    }


def _new(request: Request, session: Session, form: Mapping[str, Any], error: InbandError | None = None) -> Response:
    return page(
        request,
        "geometric_form/new.html",
        refusal=error,
        form=form,
        errors=by_field(error, _shown_at) if error else {},
        shown=FIELDS,
        machines=machines(session),
        kinds=wording.kinds(),
    )


def _shown_at(field: str, message: str) -> tuple[str, str]:
    """The field of the form where the value was typed."""
    name = "datum" if field.partition(".")[0] == "datum" else field.partition(".")[0].partition("[")[0]
    where = field.removeprefix("datum.")
    inner = "[" in where and "Section" not in message
    return SHOWN_AT.get(name, name), f"{where}: {message}" if inner else message


@router.post("/forms/new")
def measure(request: Request, session: SessionDep, caller: Operator, form: FormDep) -> Response:
    """Evaluate and keep what was typed; or show what is wrong with it, with everything still there."""
    try:
        body = parsed(FormIn, form_reader.fields(form))
        created = actions.measure_and_push(session, machine_named(session, body.machine), body, caller)
    except (Invalid, NotFound) as error:
        return _new(request, session, form, error)
    return RedirectResponse(f"/forms/{created.row.measurement.id}", 303)


@router.get("/forms/{form}")
def form_page(
    request: Request, session: SessionDep, caller: Viewer, form: int, section: Annotated[int, Query(ge=1, le=1000)] = 1
) -> Response:
    """One measurement: verdict, every method, pictures, touches, suspects."""
    row = queries.form(session, form)
    return page(
        request,
        "geometric_form/form.html",
        row=row,
        machine=machine_named(session, row.machine),
        measurement=row.measurement,
        evaluation=row.evaluation,
        result=row.evaluation.result,
        details=row.evaluation.result["details"],
        section=section,
        became=queries.became(session, [row]).get(form),
        evaluations=queries.evaluations(session, row),
        warnings=[
            sentence(warning)
            for warning in warnings_of(
                row.measurement.kind, row.measurement.given, row.evaluation.result, row.plausible_shift
            )
            if warning.code != "touch_does_not_fit"  # suspected touches are reported one by one
        ],
        engine=ENGINE,
        wording=wording,
        trend=trend_url(row.machine, row.measurement.feature, row.measurement.kind),
        may_measure=caller.may("operator"),
    )


@router.post("/forms/{form}/recompute")
def recompute(session: SessionDep, caller: Operator, form: int) -> Response:
    """Evaluate the stored touches again."""
    actions.recompute(session, form, _("computed again on the page"), caller)
    return RedirectResponse(f"/forms/{form}", 303)
