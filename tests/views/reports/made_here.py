"""Reports of many, made by the process of the test.

To begin a process for them takes five seconds of a processor; that a server does is seen in tests/views/reports/test_jobs.py.
"""

import psycopg

from app.db.engine import Database
from app.views.reports.bundle import Bundle, BundleFormat
from app.views.reports.maker import Maker
from app.views.reports.request import ReportRequest
from app.views.reports.tables import ReportJob
from app.views.reports.worker import LOCK


def made_here(database: Database, request: ReportRequest, form: BundleFormat, *keys: str) -> int:
    """The number of a job that is over. No server of this database takes it up."""
    with psycopg.connect(database.dsn) as works_on_it:
        with database.begin() as session:
            job = ReportJob(asked_by="tests", request=Bundle(request, form).stored(keys), total=len(keys))
            session.add(job)
            session.flush()
            number = job.id
            works_on_it.execute(f"SELECT pg_advisory_lock({LOCK})", [number])
        Maker(database).do(number)
    return number
