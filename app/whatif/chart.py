"""From a what-if as it is worked out to the one that is drawn: courses thinned so that no extreme is lost."""

import numpy as np
from numpy.typing import NDArray

from app.whatif.figures import CourseChart, Line
from app.whatif.queries import Answer

MOST_POINTS = 500  # readings drawn one by one; of more, the extremes of so many stretches


def chart_of(answer: Answer) -> CourseChart:
    """What the figure needs; offsets as the size that they take out, mm."""
    past, parameters = answer.past, answer.past.standing.parameters
    sequence = past.history["sequence"]
    return CourseChart(
        key=past.standing.characteristic.key,
        today=thinned(sequence, answer.today_course.deviation[past.mine]),
        other=thinned(sequence, answer.other_course.deviation[past.mine]),
        today_taken=thinned(sequence, answer.today_course.offset[past.mine] / parameters.factor),
        other_taken=thinned(sequence, answer.other_course.offset[past.mine] / parameters.factor),
        half=parameters.tolerance_width / 2,
        readings=len(sequence),
    )


def thinned(sequence: NDArray[np.int64], values: NDArray[np.float64]) -> Line:
    """Every reading, or of each stretch its smallest and its largest, in the order in which they came."""
    if len(values) <= MOST_POINTS:
        return Line(sequence.tolist(), values.tolist())
    stretches = np.array_split(np.arange(len(values)), MOST_POINTS // 2)
    at = np.unique(np.concatenate([[each[values[each].argmin()], each[values[each].argmax()]] for each in stretches]))
    return Line(sequence[at].tolist(), values[at].tolist())
