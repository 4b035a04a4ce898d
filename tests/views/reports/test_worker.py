"""The process that makes reports, as the server begins it: what it hears, and its end by SIGKILL."""

import io
import os
from unittest.mock import Mock, create_autospec

import pytest

from app.db.engine import Database
from app.jobs.actions import DatabaseGone
from app.jobs.queries import failures
from app.memory import BEHIND, NICE
from app.quality.proof import queries as proof
from app.quality.proof.cases import cases
from app.settings import Settings
from app.views.reports import maker, queries, worker

KNOWN = {
    "passed": proof.Proof((proof.Result(cases()[0], ()),)),
    "failed": proof.Proof((proof.Result(cases()[0], (), "ValueError: planted"),)),
    "not yet known": None,
}


@pytest.mark.parametrize("known", KNOWN)
def test_that_its_engine_has_proved_itself_and_nothing_else(monkeypatch: pytest.MonkeyPatch, known: str) -> None:
    monkeypatch.setattr(proof, "_proof", KNOWN[known])
    monkeypatch.setattr(worker, "PROGRAM", "import sys; sys.stdout.write(sys.stdin.readline() + sys.stdin.readline())")
    begun = worker.ReportWorker(create_autospec(Database), Settings(timezone="Asia/Tokyo"))._begun()
    heard = begun.communicate(timeout=60)[0]

    given = Mock(return_value=cases()[:1])
    monkeypatch.setattr(proof, "_proof", None)
    monkeypatch.setattr(proof, "_begun", None)
    monkeypatch.setattr(proof, "cases", given)
    assert maker.settings_from(io.StringIO(heard)).timezone == "Asia/Tokyo"
    assert proof.proof().failing == proof.failing() == ()
    assert given.called is (known != "passed"), "it proves for itself what the server does not know, or found wrong"


DIES_OF_1 = f"""{BEHIND}
import os, signal, sys
settings, proved = sys.stdin.readline(), sys.stdin.readline()
for number in map(int, sys.stdin):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    print(f"{{os.getpriority(os.PRIO_PROCESS, 0)}} of {{number}}", flush=True)"""


def test_one_that_is_killed_fails_its_job_alone_and_the_next_goes_behind_readings(
    monkeypatch: pytest.MonkeyPatch, database: Database
) -> None:
    monkeypatch.setattr(worker, "PROGRAM", DIES_OF_1)
    monkeypatch.setattr(queries, "open_jobs", lambda _session: [1, 2])
    making = worker.ReportWorker(database, Settings())
    expected = min(os.getpriority(os.PRIO_PROCESS, 0) + NICE, 19)
    try:
        with pytest.raises(DatabaseGone, match=f"^{expected} of 2$"):  # whatever it answers is why there is no database
            making._look()
        with database.begin() as session:
            (failure,) = failures(session)
        assert (failure.subject, failure.error) == (
            "reports/1",
            "RuntimeError: the process that makes reports ended with -9",
        )
        with pytest.raises(DatabaseGone, match=f"^{expected} of 2$"):
            making._look()  # the first waits for its time, in a minute
    finally:
        making._end()
