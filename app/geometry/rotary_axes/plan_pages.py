"""Page: the measuring plan of rotary axes. The address says everything, nothing is stored."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from app.access.deps import require
from app.core.rotary.axis import AXES
from app.core.rotary.measuring_plan import OF_AXIS
from app.errors import Invalid
from app.geometry.rotary_axes.plan_api import checked
from app.geometry.rotary_axes.plan_schemas import MeasuringPlanIn, MeasuringPlanOut, from_q, plan_out
from app.geometry.rotary_axes.plan_wording import asked_for
from app.web.forms import length, parsed, whole
from app.web.templates import page

router = APIRouter(include_in_schema=False)
OF_CALL = ("Q407", "Q320", "Q408", "Q253", "Q380", "Q432")
COUNTS = ("Q423", "Q406", "Q431", "Q409")
BEGUN = {
    "cycle": "452",
    "Q320": "0",
    "Q408": "0",
    "Q253": "750",
    "Q380": "0",
    "Q423": "4",
    "Q432": "0",
    "Q406": "0",
    "Q431": "0",
    "Q409": "0",
} | {q: "0" for names in OF_AXIS.values() for q in names}
COLUMNS = ("start", "end", "incidence", "points")


@router.get("/kinematics/measuring-plan", dependencies=[require("viewer")])
def measuring_plan_page(request: Request) -> Response:
    """The form, and once the radius of the sphere is said the positions, the warnings and the program."""
    typed = {name: value.strip()[:40] for name, value in request.query_params.items() if len(name) < 12}
    begun = BEGUN | typed
    plan: MeasuringPlanOut | None = None
    error: Invalid | None = None
    if typed.get("Q407") is not None:
        try:
            body = parsed(MeasuringPlanIn, _fields(begun))
            plan = plan_out(checked(body), body.memory)
        except Invalid as refusal:
            error = refusal
    return page(
        request,
        "rotary_axes/measuring_plan.html",
        status=422 if error else 200,
        typed=begun,
        errors=_at_fields(error) if error else {},
        plan=plan,
        axes=[(letter, list(zip(OF_AXIS[letter], COLUMNS, strict=True))) for letter in AXES],
        asked_for=asked_for(),
        download=f"data:text/plain;charset=utf-8,{quote(plan.text)}" if plan else "",
    )


def _fields(typed: Mapping[str, str]) -> dict[str, Any]:
    values: dict[str, Any] = {q: length(typed.get(q)) for q in OF_CALL}
    values |= {q: whole(_count(typed.get(q, ""))) for q in COUNTS}
    values |= {"cycle": whole(typed.get("cycle"))}
    for q in ("Q253", "Q320"):
        if isinstance(values[q], str):
            values[q] = values[q].upper()
    return from_q(values, [_axis(letter, typed) for letter in AXES])


def _axis(letter: str, typed: Mapping[str, str]) -> dict[str, Any]:
    start, end, incidence, points = OF_AXIS[letter]  # type: ignore[index]
    low, high = length(typed.get(f"low_{letter}")), length(typed.get(f"high_{letter}"))
    values: dict[str, Any] = {"axis": letter, "teeth": length(typed.get(f"teeth_{letter}"))}
    values |= {
        "start": length(typed.get(start)),
        "end": length(typed.get(end)),
        "incidence": length(typed.get(incidence)),
    }
    values |= {"points": whole(_count(typed.get(points, ""))), "encoder": typed.get(f"encoder_{letter}") != "none"}
    values["travel"] = None if low is None and high is None else [low, high]
    return {name: value for name, value in values.items() if value is not None}


def _count(text: str) -> str:
    """A count as a program writes it: `+4`, `4.0`."""
    return text.removeprefix("+").removesuffix(".0")


def _at_fields(error: Invalid) -> dict[str, str]:
    """Messages by the field of the form."""
    names = {name: q for name, q in from_q({q: q for q in (*OF_CALL, *COUNTS, "cycle")}, []).items() if name != "axes"}
    messages: dict[str, str] = {}
    for field, message in error.errors:
        top, _bracket, rest = field.partition("[")
        name = names.get(top.partition(".")[0], top)
        if top == "axes" and rest[:1].isdigit():
            letter = AXES[int(rest[0])]
            inner = rest.partition(".")[2].partition("[")[0]
            name = dict(zip(COLUMNS, OF_AXIS[letter], strict=True)).get(inner, f"{inner or 'axis'}_{letter}")
            name = {f"travel_{letter}": f"low_{letter}", f"axis_{letter}": f"low_{letter}"}.get(name, name)
        messages[name] = message[:1].upper() + message[1:]
    return messages
