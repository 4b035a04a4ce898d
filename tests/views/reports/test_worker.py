"""What the server tells the process that makes its reports."""

import io
from unittest.mock import Mock, create_autospec

import pytest

from app.db.engine import Database
from app.quality.proof import queries as proof
from app.quality.proof.cases import cases
from app.settings import Settings
from app.views.reports import maker, worker

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
