"""Queries over many readings at once.

Small windows are read directly. Large ones are read from the pyramid of summaries (`reading_summary`), so that ten million
readings cost little more than ten thousand, and no extreme is thinned away.
"""

from app.loop.summaries.queries.chart_data import ChartData, ChartReading, chart_data_of, moments_of, single_readings
from app.loop.summaries.queries.context import OLDER, WITHOUT, Strata, in_context, offered, strata_of
from app.loop.summaries.queries.history import History, history_of
from app.loop.summaries.queries.numbers import MOST_IN_HISTOGRAM, Numbers, Unworn, histogram_of, numbers_of, unworn_of
from app.loop.summaries.queries.pyramid import Block
from app.loop.summaries.queries.results import (
    Rejects,
    rejects_by_characteristic,
    rejects_of,
    results_of,
    since_tool_change,
    tool_since,
)
from app.loop.summaries.queries.window import Window, window_of

__all__ = [
    "MOST_IN_HISTOGRAM",
    "OLDER",
    "WITHOUT",
    "Block",
    "ChartData",
    "ChartReading",
    "History",
    "Numbers",
    "Rejects",
    "Strata",
    "Unworn",
    "Window",
    "chart_data_of",
    "histogram_of",
    "history_of",
    "in_context",
    "moments_of",
    "numbers_of",
    "offered",
    "rejects_by_characteristic",
    "rejects_of",
    "results_of",
    "since_tool_change",
    "single_readings",
    "strata_of",
    "tool_since",
    "unworn_of",
    "window_of",
]
