"""What reports are gathered from. Never writes.

report_of(…)   one characteristic and one period, as content
job, jobs, …   reports that were asked for many at once
"""

from app.reports.queries.gathering import report_of, title_of

__all__ = ["report_of", "title_of"]
