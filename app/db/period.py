"""The border of a period, as PostgreSQL reads it: from its start on, and before its end. What a period is is in the core."""

from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, and_, true


def in_period(column: Any, period: tuple[datetime | None, datetime | None]) -> ColumnElement[bool]:
    """Lies in the period (start, end), as a condition on a column of moments; None is an open end."""
    start, end = period
    return and_(true() if start is None else column >= start, true() if end is None else column < end)


def in_period_sql(column: str) -> str:
    """The same in SQL as text; :start and :end are the period's, null where it is open."""
    return (
        f"(CAST(:start AS timestamptz) IS NULL OR {column} >= :start) "
        f"AND (CAST(:end AS timestamptz) IS NULL OR {column} < :end)"
    )
