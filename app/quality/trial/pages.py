"""Pages: the shadow trial of a characteristic, and the question that ends it."""

from collections.abc import Mapping
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Engineer, Viewer
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic, characteristic_named
from app.quality.trial import queries
from app.quality.trial.queries import Settings, Trial
from app.quality.trial.verbs import START, OfTrial
from app.web.deps import FormDep, SessionDep, Word
from app.web.templates import page
from app.web.verb import ask, carry_out

router = APIRouter(include_in_schema=False)
With = Annotated[Literal["proposed", "today"], Query(alias="with")]


@router.get("/characteristics/{characteristic}/trial")
def trial_page(
    request: Request, session: SessionDep, caller: Viewer, characteristic: str, done: Word = None, late: Word = None
) -> Response:
    """Side by side: as it was measured, and as a loop would have corrected it. done, late: the end of the trial."""
    current = characteristic_named(session, characteristic)
    trial, too_few = _trial(session, current)
    return page(
        request,
        "trial/trial.html",
        current=current,
        characteristic=current.characteristic,
        parameters=current.parameters,
        trial=trial,
        too_few=too_few,
        enough=queries.ENOUGH,
        may_start=caller.may("engineer") and current.parameters.measures_only and bool(current.parameters.tool_memory),
        done=START.said() if done else None,
        late=bool(late),
    )


def _trial(session: Session, current: CurrentCharacteristic) -> tuple[Trial | None, Invalid | None]:
    """The trial, or why there is none yet."""
    try:
        return queries.trial_of(session, current), None
    except Invalid as refused:
        return None, refused


@router.get("/characteristics/{characteristic}/trial/start")
def ask_start(
    request: Request, session: SessionDep, caller: Engineer, characteristic: str, chosen: With = "proposed"
) -> Response:
    """The question before the characteristic corrects: by the proposed settings, or by those in force."""
    current = characteristic_named(session, characteristic)
    trial, _too_few = _trial(session, current)
    settings = trial.settings if trial and chosen == "proposed" else None
    return _ask(request, OfTrial(session, characteristic, caller, settings))


def _ask(
    request: Request, on: OfTrial, form: Mapping[str, str] | None = None, error: Invalid | None = None
) -> Response:
    current = on.current
    home = f"/characteristics/{on.key}"
    question = START.question(on, f"{home}/trial/start")
    trail = [(_("Plant"), "/"), (current.characteristic.name, home), (_("Shadow trial"), f"{home}/trial")]
    return ask(
        request, "tools/ask.html", question, form, error, machine=current.machine, trail=trail, back=f"{home}/trial"
    )


@router.post("/characteristics/{characteristic}/trial/start")
def start(request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep) -> Response:
    """End the trial. Sent twice, or after someone else, it changes nothing and says so."""
    on = OfTrial(session, characteristic, caller, _settings_of(form))
    try:
        outcome = carry_out(START, on, form)
    except Invalid as error:
        return _ask(request, on, form, error)
    return RedirectResponse(f"/characteristics/{characteristic}/trial?{outcome.kind}=1", 303)


def _settings_of(form: Mapping[str, str]) -> Settings | None:
    """The settings that the question was asked with."""
    try:
        return Settings(float(form["weighting_factor"]), float(form["zero_range"]))
    except (KeyError, ValueError):
        return None
