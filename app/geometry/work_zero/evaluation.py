"""From what is kept of a work zero to the zero and its warnings. Pure but for the words of refusals. Lengths in mm."""

from collections.abc import Mapping
from typing import Any

from app.core.geometry.edges import Approach, EdgeKind, Touch, Unfit
from app.core.geometry.plausible import zero_warnings
from app.core.geometry.points import Degenerate
from app.core.geometry.work_zero import Height, Zero, find_zero, four_records
from app.core.warning import CodedWarning, of_stored
from app.errors import FieldError, Invalid
from app.geometry.work_zero import wording
from app.geometry.work_zero.tables import WorkZero
from app.language.i18n import _
from app.loop.tables.machines import Machine
from app.loop.warnings.queries import bounds_of


def warnings_in(solution: Zero, zero: WorkZero, machine: Machine, before: Mapping[str, float]) -> list[CodedWarning]:
    """Return what may be wrong with a zero. before: the place that its fixture is compared with, by axis."""
    return zero_warnings(solution, bounds_of(machine), feeler=zero.given.get("feeler", 0.0), before=before)


def warnings_of(zero: WorkZero, machine: Machine) -> list[CodedWarning]:
    """Return what may be wrong with a zero: as it was kept with it, or, of one from before that, by itself and the limits of now."""
    if "warnings" in zero.result:
        return of_stored(zero.result["warnings"])
    return warnings_in(evaluated(zero.kind, zero.given), zero, machine, {})


def _touches(kind: str, inputs: dict[str, Any]) -> list[Touch]:
    if inputs.get("records"):
        return four_records(EdgeKind(kind), *inputs["records"])
    return [
        Touch(touch.get("x"), touch.get("y"), Approach(touch["approach"]) if touch.get("approach") else None)
        for touch in inputs.get("touches") or ()
    ]


def touches_of(kind: str, inputs: dict[str, Any]) -> list[dict[str, Any]]:
    """The touches that it was computed from, also where they came as records of a printed macro."""
    return [
        {"x": touch.x, "y": touch.y, "approach": touch.approach.value if touch.approach else None}
        for touch in _touches(kind, inputs)
    ]


def evaluated(kind: str, inputs: dict[str, Any]) -> Zero:
    """Compute the zero from its probed points. Raises `Invalid` that names those that are wrong."""
    if inputs.get("touches") and inputs.get("records"):
        raise Invalid.at("records", _("state touches or records, not both"), do=_("Leave one of them out."))
    touches = _touches(kind, inputs)
    height = None
    if inputs.get("z_touched") is not None:
        height = Height(inputs["z_touched"], inputs.get("feeler", 0.0), inputs.get("tool_length", 0.0))
    try:
        return find_zero(
            EdgeKind(kind), touches, inputs["tip"], height=height, repeatability=inputs.get("repeatability")
        )
    except Unfit as problem:
        wrong, remedy = wording.unfit(problem)
        at = problem.at
    except Degenerate as problem:
        wrong, remedy = wording.degenerate(problem)
        at = problem.at
    fields = [f"touches[{number - 1}]" for number in at] if at and not inputs.get("records") else ["touches"]
    if inputs.get("records"):
        fields = ["records"]
    raise Invalid(f"{fields[0]}: {wrong}.", remedy, errors=[FieldError(name, wrong) for name in fields])
