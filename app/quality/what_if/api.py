"""JSON routes: what if, as numbers, map and figure; proposals of changes and what becomes of them."""

from typing import Annotated, Literal

from fastapi import Depends, Path, Query, Response

from app.access.deps import AnyCaller, Engineer, Operator, require
from app.core.replay import LONGEST_DELAY
from app.loop.characteristics import queries as characteristics
from app.loop.timeline import queries as timeline
from app.quality.what_if import actions, proposals, simulation
from app.quality.what_if.chart import chart_of
from app.quality.what_if.figures import course_figure
from app.quality.what_if.schemas import (
    LARGEST_LENGTH,
    MapIn,
    MapOut,
    ProposalDecisionIn,
    ProposalIn,
    ProposalOut,
    SampledIn,
    SampledOut,
    WhatIfByIn,
    WhatIfIn,
    WhatIfOut,
)
from app.quality.what_if.strata import strata_of
from app.web.api import FIGURE, Before, CharacteristicKey, Limit, Theme, Width, api_router, chart_answer, problems
from app.web.choice import InPeriod
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, page_of

router = api_router("what-if")

Number = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the proposal.", examples=[1])]
Status = Annotated[
    Literal["open", "outdated", "approved", "rejected", "withdrawn"] | None,
    Query(description="Only those with this status."),
]


@router.post(
    "/characteristics/{characteristic}/what-if", responses=problems(404, 429), dependencies=[require("viewer")]
)
def replay_readings(session: SessionDep, characteristic: CharacteristicKey, asked: WhatIfByIn) -> WhatIfOut:
    """Replay stored readings with other settings, side by side with today's; nothing is changed.

    The corrections in effect are taken out, the process without them is rebuilt, and the other policy is run in closed loop
    on it. `likeness` says how far the rebuilt loop is to be believed. At most a million readings; two replays at once. With
    `by` the results of each order, nest … are beside those of all.
    """
    current = characteristics.characteristic_named(session, characteristic)
    answer = simulation.replayed(session, current, asked)
    return WhatIfOut.of(answer, strata_of(session, answer, asked.by) if asked.by is not None else None)


@router.post(
    "/characteristics/{characteristic}/what-if/sampling", responses=problems(404, 429), dependencies=[require("viewer")]
)
def sample_readings(session: SessionDep, characteristic: CharacteristicKey, asked: SampledIn) -> SampledOut:
    """Replay stored readings as if 1 in N parts had been measured; nothing is changed.

    A part that is not measured is cut with the offset of the moment, raises no alarm and asks for no correction. Each stored reading is
    taken for a part: what was not measured then is not known now.
    """
    current = characteristics.characteristic_named(session, characteristic)
    return SampledOut.of(simulation.sampled(session, current, asked))


@router.post(
    "/characteristics/{characteristic}/what-if/map", responses=problems(404, 429), dependencies=[require("viewer")]
)
def map_settings(session: SessionDep, characteristic: CharacteristicKey, asked: MapIn) -> MapOut:
    """Replay a grid of k and R33, and say where it is best; cells where R33 < R34 does not hold are blank.

    At most 2500 settings, and 200 million decisions (settings times readings).
    """
    current = characteristics.characteristic_named(session, characteristic)
    return MapOut.of(simulation.mapped(session, current, asked))


def asked_for(
    period: InPeriod,
    weighting_factor: Annotated[float | None, Query(ge=1, le=1_000_000, description="k (R29); else today's.")] = None,
    zero_range: Annotated[float | None, Query(ge=0, le=LARGEST_LENGTH, description="R33, mm; else today's.")] = None,
    averaging_limit: Annotated[
        float | None, Query(ge=0, le=LARGEST_LENGTH, description="R34, mm; else today's.")
    ] = None,
    factor: Annotated[float | None, Query(ge=-1000, le=1000, description="Else today's.")] = None,
    delay: Annotated[int | None, Query(ge=0, le=LONGEST_DELAY, description="Parts; else as it was most often.")] = None,
    effect: Annotated[float, Query(ge=0.05, le=5, description="The share of a correction that acts.")] = 1.0,
    measured: Annotated[bool, Query(description="As measured on these readings, whatever `effect` says.")] = False,
    last: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="The last N readings.")] = None,
) -> WhatIfIn:
    """The question as an address says it."""
    return WhatIfIn.model_validate(
        {
            "weighting_factor": weighting_factor,
            "zero_range": zero_range,
            "averaging_limit": averaging_limit,
            "factor": factor,
            "delay": delay,
            "effect": None if measured else effect,
            "last": last,
            "from": period.start,
            "to": period.end,
        }
    )


@router.get(
    "/characteristics/{characteristic}/figures/what-if", responses=problems(404, 429) | FIGURE, response_model=None
)
def get_what_if_figure(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    asked: Annotated[WhatIfIn, Depends(asked_for)],
    theme: Theme = "light",
    width: Width = 1240,
) -> Response:
    """Deviations with today's and the other settings, and what each loop had taken out by its corrections."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    chart = chart_of(simulation.replayed(session, current, asked))
    return chart_answer(timeline.with_events(session, current, course_figure(chart, width=width), width), theme)


@router.post("/characteristics/{characteristic}/proposals", status_code=201, responses=problems(404, 409, 429))
def propose_change(
    session: SessionDep, caller: Operator, characteristic: CharacteristicKey, proposal: ProposalIn, response: Response
) -> ProposalOut:
    """Propose settings as a change of the parameters; the figures side by side are kept with it as evidence."""
    current = characteristics.characteristic_named(session, characteristic)
    row = actions.propose(session, simulation.replayed(session, current, proposal), proposal.reason, caller)
    response.headers["Location"] = f"/api/v1/proposals/{row.proposal.id}"
    return ProposalOut.of(row)


@router.get("/characteristics/{characteristic}/proposals", responses=problems(404))
def list_proposals_of(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    status: Status = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[ProposalOut]:
    """Proposals for this characteristic, newest first."""
    current = characteristics.characteristic_for(session, caller, characteristic, "viewer")
    rows = proposals.proposals(
        session, characteristic=current.characteristic, status=status, before=before, limit=limit + 1
    )
    return page_of([ProposalOut.of(row) for row in rows], limit, lambda row: row.id)


@router.get("/proposals", dependencies=[require("viewer")])
def list_proposals(
    session: SessionDep,
    status: Status = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[ProposalOut]:
    """All proposals, newest first."""
    rows = proposals.proposals(session, status=status, before=before, limit=limit + 1)
    return page_of([ProposalOut.of(row) for row in rows], limit, lambda row: row.id)


@router.get("/proposals/{proposal}", responses=problems(404), dependencies=[require("viewer")])
def get_proposal(session: SessionDep, proposal: Number) -> ProposalOut:
    """One proposal with its evidence."""
    return ProposalOut.of(proposals.proposal(session, proposal))


@router.post("/proposals/{proposal}/approve", responses=problems(404, 409))
def approve_proposal(
    session: SessionDep, caller: Engineer, proposal: Number, decision: ProposalDecisionIn
) -> ProposalOut:
    """Put it in force as a new version of the parameters; 409 if they have changed since it was proposed."""
    return ProposalOut.of(actions.approve(session, proposal, decision.reason, caller))


@router.post("/proposals/{proposal}/reject", responses=problems(404, 409))
def reject_proposal(
    session: SessionDep, caller: Engineer, proposal: Number, decision: ProposalDecisionIn
) -> ProposalOut:
    """Say no, and why."""
    return ProposalOut.of(actions.reject(session, proposal, decision.reason, caller))


@router.post("/proposals/{proposal}/withdraw", responses=problems(404, 409))
def withdraw_proposal(
    session: SessionDep, caller: Operator, proposal: Number, decision: ProposalDecisionIn
) -> ProposalOut:
    """Take back what one has proposed oneself."""
    return ProposalOut.of(actions.withdraw(session, proposal, decision.reason, caller))
