"""Requests for a report."""

from datetime import datetime

import pytest

from app.core.period import Period
from app.errors import Invalid
from app.views.reports.request import ReportRequest


@pytest.mark.parametrize("moment", ["9999-12-31T23:59:59-14:00", "0001-01-01T00:00:00+00:00"])
@pytest.mark.parametrize("end", ["start", "end"])
def test_a_moment_that_some_time_zone_cannot_write_is_refused_in_words(moment: str, end: str) -> None:
    with pytest.raises(Invalid, match="years 1 to 9999"):
        ReportRequest(Period(**{end: datetime.fromisoformat(moment)}))
