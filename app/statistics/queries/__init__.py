"""Everything that is read of many readings at once.

Small runs are read as they are. Large ones are read from the pyramid of summaries (`reading_summary`), so that ten million
readings cost little more than ten thousand, and no extreme is thinned away.
"""

from app.statistics.queries.course import Course, course_of, moments_of
from app.statistics.queries.history import History, history_of
from app.statistics.queries.numbers import MOST_IN_HISTOGRAM, Numbers, histogram_of, numbers_of
from app.statistics.queries.pyramid import Block
from app.statistics.queries.results import (
    Rejects,
    rejects_by_characteristic,
    rejects_of,
    results_of,
    since_tool_change,
)
from app.statistics.queries.window import Window, window_of

__all__ = [
    "MOST_IN_HISTOGRAM",
    "Block",
    "Course",
    "History",
    "Numbers",
    "Rejects",
    "Window",
    "course_of",
    "histogram_of",
    "history_of",
    "moments_of",
    "numbers_of",
    "rejects_by_characteristic",
    "rejects_of",
    "results_of",
    "since_tool_change",
    "window_of",
]
