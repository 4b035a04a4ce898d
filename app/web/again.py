"""Computing probed points once more: what is sent for it, and the inputs that follow."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from app.errors import Invalid
from app.language.i18n import _
from app.web.fields import IN_UM, Body, Reason

MOST_TOUCHES = 1000  # a hundred holes of a plate, ten touches each

Repeatability = Annotated[
    float,
    IN_UM,
    Field(
        strict=True,
        gt=0,
        le=1,
        allow_inf_nan=False,
        description="Standard deviation of one touch; with it the answer states uncertainties (95 %).",
    ),
]


class TouchesAgainIn(Body):
    """The same touches once more, perhaps without some of them. The first result stays on record."""

    repeatability: Repeatability | None = None
    leave_out: Annotated[
        list[Annotated[int, Field(strict=True, ge=1, le=MOST_TOUCHES)]],
        Field(max_length=MOST_TOUCHES, description="Touches that do not count, from 1."),
    ] = Field(default=[])
    reason: Reason

    def applied_to(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """The inputs of a result with what is sent in place of what they were. Raises `Invalid` for a touch not there."""
        changed = dict(inputs)
        if self.repeatability is not None:
            changed["repeatability"] = self.repeatability
        if self.leave_out:
            touches = inputs.get("touches") or []
            beyond = [at for at in self.leave_out if at > len(touches)]
            if beyond:
                raise Invalid.at("leave_out", _("there is no point {at}").format(at=", ".join(map(str, beyond))))
            changed["touches"] = [touch for at, touch in enumerate(touches, 1) if at not in self.leave_out]
        return changed
