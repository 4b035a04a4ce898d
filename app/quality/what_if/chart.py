"""From a what-if as it is worked out to the one that is drawn: courses thinned so that no extreme is lost."""

import numpy as np
from numpy.typing import NDArray

from app.quality.what_if.figures import Course, CourseChart
from app.quality.what_if.queries import Simulation

MOST_POINTS = 500  # readings drawn one by one; of more, the extremes of this many stretches


def chart_of(answer: Simulation) -> CourseChart:
    """Values of the figure; offsets as the size that they take out, mm."""
    past, parameters = answer.past, answer.past.current.parameters
    sequence = past.history["sequence"]
    return CourseChart(
        key=past.current.characteristic.key,
        today=thinned(sequence, answer.today_result.deviation[past.mine]),
        other=thinned(sequence, answer.other_result.deviation[past.mine]),
        today_taken=thinned(sequence, answer.today_result.offset[past.mine] / parameters.factor),
        other_taken=thinned(sequence, answer.other_result.offset[past.mine] / parameters.factor),
        half=parameters.half,
        natural_limit=parameters.natural_limit,
        readings=len(sequence),
    )


def thinned(sequence: NDArray[np.int64], values: NDArray[np.float64]) -> Course:
    """Every reading, or of each stretch its smallest and its largest, in the order in which they came."""
    if len(values) <= MOST_POINTS:
        return Course(sequence.tolist(), values.tolist())
    stretches = np.array_split(np.arange(len(values)), MOST_POINTS // 2)
    at = np.unique(
        np.concatenate(
            [[stretch[values[stretch].argmin()], stretch[values[stretch].argmax()]] for stretch in stretches]
        )
    )
    return Course(sequence[at].tolist(), values[at].tolist())
