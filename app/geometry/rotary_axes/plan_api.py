"""JSON route: a measuring plan looked at and written before it is run. Nothing is stored."""

from app.access.deps import require
from app.core.rotary.measuring_plan import MeasuringPlan, faults
from app.errors import FieldError, Invalid
from app.geometry.rotary_axes.plan_schemas import MeasuringPlanIn, MeasuringPlanOut, plan_out
from app.geometry.rotary_axes.plan_wording import sentence
from app.language.i18n import _
from app.web.api import api_router

router = api_router("kinematics")


@router.post("/kinematics/measuring-plans", dependencies=[require("viewer")])
def write_measuring_plan(body: MeasuringPlanIn) -> MeasuringPlanOut:
    """Write the program of cycle 451 or 452, with the positions of each axis and what may go wrong. Nothing is stored.

    422 for what the control would refuse: Hirth teeth without a retract height, or a position beyond a limit switch.
    """
    return plan_out(checked(body), body.memory)


def checked(body: MeasuringPlanIn) -> MeasuringPlan:
    """The plan. Raises `Invalid` for what the control would refuse."""
    plan = body.plan()
    errors = [FieldError(fault.field or "axes", sentence(fault)) for fault in faults(plan)]
    if errors:
        raise Invalid.of(errors, _("Correct the named fields; nothing was written."))
    return plan
