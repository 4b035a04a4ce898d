"""Content of reports. Never writes.

report_of(…)   one characteristic and one period, as content
job, jobs, …   reports that were asked for many at once
"""

from app.views.reports.queries.gathering import report_of, title_of
from app.views.reports.queries.jobs import content, count_open, job, jobs, may_end, open_jobs, parts, troubles

__all__ = ["content", "count_open", "job", "jobs", "may_end", "open_jobs", "parts", "report_of", "title_of", "troubles"]
