"""Pages: the what-if of a characteristic, the list of proposals, and one proposal with its evidence."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Operator, Viewer, require
from app.core.context import ContextField
from app.core.policy_map import Criterion
from app.errors import Conflict, InbandError, Invalid, TooManyRequests
from app.language.formatting import short
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines import queries as machines
from app.loop.readings.wording import field_word
from app.loop.summaries import queries as summaries
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.quality.what_if import actions, form_reader, map_axes, proposals, simulation, wording
from app.quality.what_if.evidence import effect_of, period_of, quote_of
from app.quality.what_if.map_view import view_of
from app.quality.what_if.queries import Map, Sampling, Simulation
from app.quality.what_if.schemas import ProposalDecisionIn, ProposalIn, SampledIn
from app.quality.what_if.strata import strata_of
from app.web.deps import Before, FormDep, SessionDep, Sought, Word
from app.web.fields import LARGEST_ID
from app.web.forms import by_field, parsed
from app.web.paging import address, part_of
from app.web.templates import page
from app.web.usual_periods import with_preset

router = APIRouter(include_in_schema=False)
ON_PAGE = 50
FEWER = [1, 2, 3, 5, 10, 20, 50]
"""Parts of which one is measured, on the page."""
Number = Annotated[int, Path(ge=1, le=LARGEST_ID)]
VERBS = {
    "approve": (actions.approve, "approved"),
    "reject": (actions.reject, "rejected"),
    "withdraw": (actions.withdraw, "withdrawn"),
}


@router.get("/characteristics/{characteristic}/what-if")
def what_if_page(request: Request, session: SessionDep, caller: Viewer, characteristic: str) -> Response:
    """Today's settings and others side by side, the map, and the form to propose them."""
    current = characteristics.characteristic_named(session, characteristic)
    asked, tool_since = request.query_params, summaries.tool_since(session, current.characteristic)
    typed = with_preset(form_reader.typed_from(asked), asked.get("preset"), tool_since)
    return _what_if(request, session, caller, current, typed)


def _what_if(
    request: Request,
    session: Session,
    caller: Caller,
    current: CurrentCharacteristic,
    typed: dict[str, str],
    *,
    reason: str = "",
    refusal: InbandError | None = None,
) -> Response:
    answer: Simulation | None = None
    fewer: Sampling | None = None
    map_result: Map | Invalid | None = None
    nothing: Invalid | None = None
    try:
        request_body = form_reader.request_of(typed)
        asked = SampledIn(**request_body.model_dump(by_alias=True), every=FEWER)
        answer, fewer, map_result = simulation.everything(session, current, asked, form_reader.map_request(typed))
    except TooManyRequests as error:
        refusal = refusal or error
    except Invalid as error:
        if error.errors:
            refusal = refusal or error
        else:
            nothing = error  # that a period holds nothing to replay is no mistake of who looks at it
    changes = wording.changed(asdict(answer.past.current.parameters), actions.changes_of(answer)) if answer else []
    key, failing = current.characteristic.key, proof.failing()
    offered = summaries.offered(session, current.characteristic)
    criterion = Criterion(typed["goal"]) if typed["goal"] in set(Criterion) else Criterion.PPK
    return page(
        request,
        "what_if/what_if.html",
        refusal=refusal,
        characteristic=current.characteristic,
        machine=current.machine,
        today=current.parameters,
        typed=typed,
        tool_since=summaries.tool_since(session, current.characteristic),
        periods=form_reader.counts(typed["last"]),
        placeholders=form_reader.placeholders(current.parameters, answer.past.delay if answer else None),
        errors=form_reader.at_fields(by_field(refusal)) if refusal else {},
        nothing=nothing,
        answer=answer,
        changes=changes,
        bys=[(by.value, field_word(by)) for by in ContextField if by in offered or by == typed["by"]],
        by=ContextField(typed["by"]) if typed["by"] else None,
        strata=strata_of(session, answer, ContextField(typed["by"])) if answer and typed["by"] else [],
        field_word=field_word,
        rows=_rows(answer, other=bool(changes)) if answer else [],
        gained=wording.gained(answer.today, answer.other) if answer else [],
        measured=effect_of(answer.effect) if answer else None,
        assumed=wording.assumed(answer.settings.effect, answer.delay) if answer else "",
        period=period_of(answer.past) if answer else None,
        effects=form_reader.effects(typed["effect"]),
        cautions=wording.cautions(answer.past) if answer else [],
        fewer=fewer,
        map=view_of(map_result, answer, typed, key) if answer and isinstance(map_result, Map) else None,
        no_map=map_result if isinstance(map_result, Invalid) else None,
        criteria=[(criterion_.value, wording.criterion(criterion_)) for criterion_ in Criterion],
        criterion=criterion,
        averaging_limits=[
            (
                short(r34 * 1000),
                form_reader.address(key, typed, r34=short(r34 * 1000)) + "#map",
                _same(r34, answer),
            )
            for r34 in map_axes.averaging_limits(current.parameters)
        ],
        link=lambda **changes: form_reader.address(key, typed, **changes),
        figure_url=f"/api/v1/characteristics/{key}/figures/what-if?{form_reader.figure_query(request_body)}"
        if answer
        else None,
        open_proposals=proposals.proposals(session, characteristic=current.characteristic, status="open"),
        reason=reason,
        may_propose=caller.may("operator"),
        wording=wording,
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def _rows(answer: Simulation, *, other: bool) -> list[tuple[str, list[str]]]:
    """Side by side, with the other settings where there are any."""
    columns = list(zip((answer.truly, answer.today, answer.other), answer.quotes, strict=True))[: 3 if other else 2]
    return wording.rows([figures for figures, _quote in columns], [quote_of(quote) for _figures, quote in columns])


def _same(r34: float, answer: Simulation | None) -> bool:
    return answer is not None and abs(answer.parameters.averaging_limit - r34) < 1e-9


@router.post("/characteristics/{characteristic}/what-if")
def send_proposal(
    request: Request, session: SessionDep, caller: Operator, characteristic: str, form: FormDep
) -> Response:
    """Propose what was replayed; the evidence is worked out again from the same question."""
    current = characteristics.characteristic_named(session, characteristic)
    typed = form_reader.typed_from(form)
    try:
        fields = form_reader.request_of(typed).model_dump(by_alias=True)
        proposal = parsed(ProposalIn, fields | {"reason": form.get("reason", "").strip()})
        answer = simulation.replayed(session, current, proposal)
        with session.begin_nested():  # what is refused lets the machine go at once
            row = actions.propose(session, answer, proposal.reason, caller)
    except (Invalid, Conflict, TooManyRequests) as error:
        session.expire_all()
        current = characteristics.characteristic_named(session, characteristic)
        return _what_if(request, session, caller, current, typed, reason=form.get("reason", ""), refusal=error)
    return RedirectResponse(f"/proposals/{row.proposal.id}?done=proposed", 303)


@router.get("/proposals", dependencies=[require("viewer")])
def proposals_page(
    request: Request,
    session: SessionDep,
    status: Annotated[str | None, Query(max_length=20)] = None,
    machine: Word = None,
    q: Sought = "",
    before: Before = None,
) -> Response:
    """Proposals, newest first: those that wait, or all; of one machine."""
    of_machine = machines.machine_named(session, machine) if machine else None
    chosen = status if status in proposals.STATUSES else "all" if status == "all" else "open"
    wanted = None if chosen == "all" else chosen
    machine_id = of_machine.id if of_machine else None
    rows = proposals.proposals(
        session, machine_id=machine_id, status=wanted, holding=q, before=before, limit=ON_PAGE + 1
    )
    link = partial(address, "/proposals", status=chosen, machine=machine or None, q=q or None)
    return page(
        request,
        "what_if/proposals.html",
        part=part_of(rows, ON_PAGE, before, lambda row: row.proposal.id, link),
        q=q,
        machine=of_machine,
        machines=machines.machines(session),
        chosen=chosen,
        statuses=[*proposals.STATUSES, "all"],
        wording=wording,
        changes=wording.proposed,
    )


@router.get("/proposals/{number}")
def proposal_page(request: Request, session: SessionDep, caller: Viewer, number: Number, done: Word = None) -> Response:
    """One proposal: what it changes, what the replay found, who decides."""
    return _proposal(request, session, caller, number, done=done)


@router.post("/proposals/{number}")
def send_decision(request: Request, session: SessionDep, caller: Operator, number: Number, form: FormDep) -> Response:
    """Approve it, reject it or withdraw it, with a reason."""
    verb = form.get("do", "")
    if verb not in VERBS:
        raise Invalid(_("Choose what to do: approve, reject or withdraw."))
    act, becomes = VERBS[verb]
    try:
        reason = parsed(ProposalDecisionIn, {"reason": form.get("reason", "").strip()}).reason
        with session.begin_nested():
            act(session, number, reason, caller)
    except (Invalid, Conflict) as error:
        session.expire_all()
        return _proposal(request, session, caller, number, typed=form, error=error)
    return RedirectResponse(f"/proposals/{number}?done={becomes}", 303)


def _proposal(
    request: Request,
    session: Session,
    caller: Caller,
    number: int,
    *,
    done: str | None = None,
    typed: Mapping[str, Any] | None = None,
    error: InbandError | None = None,
) -> Response:
    row = proposals.proposal(session, number)
    evidence = row.proposal.evidence
    truly, today, other = (wording.stored(evidence[name]) for name in ("truly", "today", "other"))
    return page(
        request,
        "what_if/proposal.html",
        refusal=error,
        row=row,
        proposal=row.proposal,
        evidence=evidence,
        differences=wording.proposed(row),
        rows=wording.rows([truly, today, other], [evidence[name] for name in ("truly", "today", "other")]),
        gained=wording.gained(today, other),
        assumed=wording.assumed(evidence["effect"], evidence["delay"]),
        replay_again=form_reader.again(row.characteristic.key, row.proposal.changes, evidence),
        done=wording.done(done) if done else None,
        typed=typed or {},
        may_decide=caller.may("engineer"),
        may_withdraw=caller.may("operator") and row.proposal.proposed_by == caller.name,
        wording=wording,
    )
