"""A test that fails shows what the servers said meanwhile, and nothing of before."""

from pathlib import Path

import pytest

from tests import server_logs


def test_what_was_added_since_the_test_began_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_logs, "_begins", {})
    old, quiet, new = (tmp_path / name for name in ("old", "quiet", "new"))
    old.write_text("before\n")
    quiet.write_text("before\n")
    for log in (old, quiet):
        server_logs.follow(log)
    server_logs.pytest_runtest_setup()
    server_logs.follow(new)
    server_logs.follow(tmp_path / "never made")
    with old.open("a") as file:
        file.write("the database does not answer\n")
    new.write_text("a" * 10_000 + "the end\n")
    told = dict(server_logs.said())
    assert told.keys() == {old, new}
    assert told[old] == "the database does not answer\n"
    assert len(told[new]) == server_logs.MOST
    assert told[new].endswith("the end\n")
    old.write_text("")  # begun anew, as PostgreSQL's log is when it is long
    assert dict(server_logs.said())[old] == ""
