"""Page: the capability of a characteristic."""

from typing import Any
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response

from app.capability import wording
from app.capability.api import Asked, AskedDep, judged
from app.capability.pictures import interval
from app.capability.queries import USUAL
from app.characteristics import queries as characteristics
from app.core.spc.refusal import Refused
from app.gauges import queries as gauges
from app.gauges import wording as gauge_wording
from app.proof import queries as proof
from app.proof import wording as proof_wording
from app.statistics import wording as statistics
from app.web.deps import AnyCaller, SessionDep, require
from app.web.i18n import _
from app.web.templates import page

router = APIRouter(include_in_schema=False)
RUNS = ("125", "500", "1000", "5000", "all")


@router.get("/characteristics/{characteristic}/capability", dependencies=[require("viewer")])
def capability_page(
    request: Request, session: SessionDep, caller: AnyCaller, characteristic: str, choice: AskedDep
) -> Response:
    """Indices with intervals and what they are worth, spread and shape, behaviour in time, the tool without corrections."""
    standing = characteristics.characteristic_named(session, characteristic)
    study = judged(session, standing, choice)
    path = f"/characteristics/{standing.characteristic.key}/capability"
    now = _query(choice)

    def link(**changes: Any) -> str:
        kept = now if not changes.keys() & {"last"} else {"side": choice.side}
        return f"{path}?{urlencode({name: value for name, value in (kept | changes).items() if value})}"

    def figure(picture: str) -> str:
        address = f"/api/v1/characteristics/{standing.characteristic.key}/figures/capability"
        return f"{address}?{urlencode(now | {'picture': picture})}"

    place = {"machine_id": standing.machine.id, "characteristic_id": standing.characteristic.id}
    timed = choice.start is not None or choice.end is not None
    failing = proof.failing()
    return page(
        request,
        "capability/capability.html",
        study=study,
        characteristic=standing.characteristic,
        machine=standing.machine,
        parameters=standing.parameters,
        choice=choice,
        runs=[
            (_("All") if run == "all" else run, link(last=run), not timed and run == (choice.last or str(USUAL)))
            for run in RUNS
        ],
        sides=[
            (words, link(side=side), side == choice.side)
            for side, words in (
                ("both", _("Both limits")),
                ("upper", _("Upper only")),
                ("lower", _("Lower only")),
            )
        ],
        figure=figure,
        interval=interval,
        refused=lambda value: isinstance(value, Refused),
        wording=wording,
        words=statistics,
        gauge_studies=gauges.studies(session, **place, limit=3),
        about_zero_range=gauges.latest_advice(session, standing),
        gauge_wording=gauge_wording,
        may_enter=caller.may("operator"),
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def _query(choice: Asked) -> dict[str, str]:
    """The choice as the address says it."""
    named = {
        "last": choice.last,
        "from": choice.start.isoformat() if choice.start else None,
        "to": choice.end.isoformat() if choice.end else None,
        "side": None if choice.side == "both" else choice.side,
        "confidence": None if choice.confidence == 0.95 else f"{choice.confidence:g}",
    }
    return {name: value for name, value in named.items() if value is not None}
