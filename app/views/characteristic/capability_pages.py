"""Page: the capability of a characteristic."""

from collections.abc import Callable
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session

from app.access.deps import AnyCaller, require
from app.core.context import Chosen, ContextField
from app.core.natural_limit import NaturalLimit
from app.core.period import ALWAYS
from app.core.spc.refusal import Refused
from app.errors import Invalid
from app.files.formats import cell_values, periods
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.readings.wording import field_word
from app.loop.summaries import queries as summaries
from app.loop.summaries import wording as statistics
from app.quality.capability import fit_wording, machine_wording, strata_queries, strata_wording, wording
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.machine_queries import newest_run
from app.quality.capability.pictures import interval
from app.quality.capability.queries import CONFIDENCE, USUAL, Side, Study
from app.quality.capability.request import Confidence, Last, OfSigma, OneSide, StudyRequest, study_of
from app.quality.gauge_studies import queries as gauges
from app.quality.gauge_studies import wording as gauge_wording
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.choice import InContext, context_in_address, in_address
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.forms import by_field
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA])
RUNS = ("125", "500", "1000", "5000", "all")


def _typed(
    given: dict[str, str], last: str | None, side: Side, confidence: float, sigma_by: SigmaBy, context: Chosen
) -> tuple[StudyRequest, dict[str, str]]:
    """Read the typed window, with errors by field; if there are any, the last readings. Moments are of the plant's time zone, unless another is named."""
    errors: dict[str, str] = {}
    zone, period = None, ALWAYS
    try:
        zone = cell_values.zone_named(given["timezone"].strip() or plant_zone().key)
    except (cell_values.Unreadable, ValueError) as error:
        errors["timezone"] = str(error)
    try:
        period = periods.period_of(given, zone)
    except Invalid as error:
        errors |= by_field(error)
    return StudyRequest(
        last, ALWAYS if errors else period, side, confidence, sigma_by=sigma_by, context=context
    ), errors


Typed = Annotated[str, Query(max_length=64)]


@router.get("/characteristics/{characteristic}/capability", dependencies=[require("viewer")])
def capability_page(
    request: Request,
    session: SessionDep,
    caller: AnyCaller,
    characteristic: str,
    context: InContext,
    start: Annotated[str, Query(alias="from", max_length=64)] = "",
    end: Annotated[str, Query(alias="to", max_length=64)] = "",
    timezone: Typed = "",
    last: Last = None,
    side: OneSide = "both",
    confidence: Confidence = CONFIDENCE,
    sigma_by: OfSigma = SigmaBy.NEIGHBOURS,
    by: Annotated[ContextField | Literal[""], Query()] = "",
) -> Response:
    """Indices with intervals and what they are worth, spread and shape, behaviour in time, the tool without corrections."""
    typed = {"from": start, "to": end, "timezone": timezone}
    choice, errors = _typed(typed, last, side, confidence, sigma_by, context)
    current = characteristics.characteristic_named(session, characteristic)
    study = study_of(session, current, choice)
    path = f"/characteristics/{current.characteristic.key}/capability"
    now = _query(choice) | ({"by": by.value} if by else {})
    ranged = {"last", "from", "to"}
    kept = {name: value for name, value in now.items() if name not in ranged}

    def link(**changes: Any) -> str:
        unchanged = kept if changes.keys() & ranged else now
        return f"{path}?{urlencode({name: value for name, value in (unchanged | changes).items() if value})}"

    def figure(picture: str) -> str:
        address = f"/api/v1/characteristics/{current.characteristic.key}/figures/capability"
        return f"{address}?{urlencode(_query(choice) | {'picture': picture})}"

    timed = choice.period.bounded
    failing = proof.failing()
    return page(
        request,
        "capability/capability.html",
        status=422 if errors else 200,
        typed=typed,
        errors=errors,
        study=study,
        characteristic=current.characteristic,
        machine=current.machine,
        parameters=current.parameters,
        choice=choice,
        kept=kept,
        **_split(session, study, choice, by or None),
        link=link,
        tool_since=summaries.tool_since(session, current.characteristic),
        runs=[
            (_("All") if run == "all" else run, link(last=run), not timed and run == (choice.last or str(USUAL)))
            for run in RUNS
        ],
        **_choices(study, choice, link),
        figure=figure,
        interval=interval,
        refused=lambda value: isinstance(value, Refused),
        wording=wording,
        fits=fit_wording,
        machine_run=newest_run(session, study) if len(study.values) else None,
        machines=machine_wording,
        words=statistics,
        gauge_studies=gauges.studies(
            session, machine_id=current.machine.id, characteristic_id=current.characteristic.id, limit=3
        ),
        about_zero_range=gauges.latest_advice(session, current),
        gauge_wording=gauge_wording,
        may_enter=caller.may("operator"),
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def _choices(study: Study, choice: StudyRequest, link: Callable[..., str]) -> dict[str, Any]:
    """The limits to choose from, and the readings whose differences give sigma within."""
    return {
        "sides": [
            (words, link(side=side), side == choice.side)
            for side, words in (
                ("both", _("Both limits")),
                ("upper", _("Upper only")),
                ("lower", _("Lower only")),
            )
            if study.natural_limit is NaturalLimit.NONE
        ],
        "sigmas": [
            (wording.sigma_by(by), link(sigma_by=None if by is SigmaBy.NEIGHBOURS else by.value), by is choice.sigma_by)
            for by in SigmaBy
        ],
    }


def _split(session: Session, study: Study, choice: StudyRequest, by: ContextField | None) -> dict[str, Any]:
    """The form for the context, and the readings split by a field of it."""
    offered = summaries.offered(session, study.current.characteristic)
    return {
        "of_context": statistics.context_form(offered, choice.context, by),
        "kept_range": _query(choice._replace(context=())),
        "strata": strata_queries.strata_of(session, study, by) if by else None,
        "strata_words": strata_wording,
        "field_word": field_word,
    }


def _query(choice: StudyRequest) -> dict[str, str]:
    """The choice as the address says it."""
    named = {
        "last": choice.last,
        **in_address(choice.period),
        **context_in_address(choice.context),
        "side": None if choice.side == "both" else choice.side,
        "sigma_by": None if choice.sigma_by is SigmaBy.NEIGHBOURS else choice.sigma_by.value,
        "confidence": None if choice.confidence == 0.95 else f"{choice.confidence:g}",
    }
    return {name: value for name, value in named.items() if value is not None}
