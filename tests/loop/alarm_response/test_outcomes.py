"""Sentences on what followed an acknowledgement."""

from types import SimpleNamespace

import pytest

from app.loop.alarm_response import outcomes


def test_the_sentence_of_a_kind_of_alarm_is_written_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name in braces within it is a text, no place for a value."""
    kind = SimpleNamespace(outcomes={"fetched": lambda item: f"File {item['file']} was fetched."})
    monkeypatch.setattr(outcomes, "kinds", lambda: [kind])
    (item,) = outcomes.outcomes([{"code": "fetched", "file": "{part}.csv"}])
    assert item["text"] == "File {part}.csv was fetched."
