"""Column types that PostgreSQL has and Python spells differently."""

from datetime import UTC, datetime

from sqlalchemy import TIMESTAMP, Dialect, TypeDecorator


class UtcTime(TypeDecorator[datetime]):
    """A moment. Goes in with any offset, comes out in UTC; a time without offset is refused, for it is no moment."""

    impl = TIMESTAMP(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is not None and value.tzinfo is None:
            raise ValueError(f"time without offset from UTC: {value!r}")
        return value

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        return None if value is None else value.astimezone(UTC)
