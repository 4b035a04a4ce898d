"""Column types that PostgreSQL has and Python spells differently."""

from datetime import UTC, datetime
from typing import Annotated

from sqlalchemy import TIMESTAMP, BigInteger, Dialect, Identity, Text, TypeDecorator, func
from sqlalchemy.orm import mapped_column


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


CreatedAt = Annotated[datetime, mapped_column(UtcTime, server_default=func.now())]
"""When the transaction that wrote the row began, by the database's clock."""

Count = Annotated[int, mapped_column(BigInteger)]
"""A number that may outgrow 2^31: sequences, totals."""

Id = Annotated[int, mapped_column(BigInteger, Identity(), primary_key=True)]
"""A number the database gives out; it may leave gaps."""

Slug = Annotated[str, mapped_column(Text)]
"""A key that people choose: ``[a-z0-9][a-z0-9._-]{0,63}``; checked at the edge."""
