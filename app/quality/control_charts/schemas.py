"""Control charts as JSON. Lengths in mm."""

from typing import Annotated

from pydantic import Field

from app.core.spc.quantity import Quantity
from app.quality.baselines.schemas import LeftOutOut
from app.web.fields import Body


class PointsOut(Body):
    """Points as columns of equal length."""

    first: list[int] = Field(description="First reading of each point.")
    last: list[int] = Field(description="Last reading of each point; of single values the same.")
    size: list[int] = Field(description="Readings in it.")
    value: Annotated[
        list[float], Field(description="What is charted: a deviation, range or s in mm; of CUSUM the upper sum.")
    ]
    below: list[float] | None = Field(description="CUSUM: the lower sum; value is the upper one.")
    centre: Annotated[
        list[float] | float | None, Field(description="Centre line; one number where all points have the same.")
    ]
    lower: list[float] | float | None = Field(description="One number where all points have the same limit.")
    upper: Annotated[
        list[float] | float | None, Field(description="Upper limit; one number where all points have the same.")
    ]


class ChartSignalOut(Body):
    """A run of points that a rule speaks of."""

    rule: Annotated[str, Field(description="Name of the rule.")]
    side: int = Field(description="1 above or rising, -1 below or falling, 0 neither.")
    first: int = Field(description="The reading that it begins with.")
    last: Annotated[int, Field(description="The reading that it ends with.")]
    points: Annotated[int, Field(description="Number of its points.")]
    text: str


class ControlOut(Body):
    """A chart in numbers: at most 10 000 points, the newest; signals of all."""

    characteristic: str
    chart: Annotated[str, Field(description="Name of the chart.")]
    quantity: Quantity
    baseline: int | None = Field(
        description="Version that judged; null: there is none in force, so there are no limits."
    )
    first_sequence: int | None
    last_sequence: int | None
    count: int = Field(description="Points; more than are listed if there are very many.")
    waiting: int = Field(description="Readings of the last subgroup, which is not complete and no point yet.")
    settling: int = Field(description="Readings that set the level of an edge and are judged by nothing.")
    left_out: LeftOutOut
    points: PointsOut
    signal_count: Annotated[
        int, Field(description="Number of all signals; more than are listed if there are very many.")
    ]
    signals: list[ChartSignalOut] = Field(description="Newest first, at most 1000.")
