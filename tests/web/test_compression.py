"""Compression of pages and JSON, and what must not be compressed."""

import re

from tests.shop import Person, Shop


def test_pages_and_figures_are_compressed_and_the_same(shop: Shop, viewer: Person) -> None:
    for reading in range(30):
        shop.read(reading / 10)
    for path in (f"/characteristics/{shop.characteristic}/readings/1", "/api/v1/openapi.json", "/proof"):
        plain = viewer.browser.get(path, headers={"Accept-Encoding": "identity"})
        small = viewer.browser.get(path)
        assert plain.headers.get("content-encoding") is None
        assert small.headers["content-encoding"] == "gzip"
        assert int(small.headers["content-length"]) < len(plain.content) / 2
        assert "Accept-Encoding" in small.headers["vary"]
        # The token is written differently each time, and the server's own jobs may add an event between the two.
        pattern = r'((?:csrf|event)" (?:content|value)=")[^"]+'
        assert re.sub(pattern, r"\1", small.text) == re.sub(pattern, r"\1", plain.text)


def test_live_events_are_not(viewer: Person) -> None:
    with viewer.browser.stream("GET", "/api/v1/events") as answer:
        assert "content-encoding" not in answer.headers


def test_the_token_of_a_session_is_written_differently_each_time(shop: Shop, engineer: Person) -> None:
    # Of the same letters in every answer the compressed length would tell (BREACH).
    pages = [engineer.open("/alarms") for _request in range(3)]
    tokens = {re.findall(r'name="csrf" content="([^"]+)"', page)[0] for page in pages}
    assert len(tokens) == 3
    for token in tokens:
        answer = engineer.browser.patch(
            f"/api/v1/machines/{shop.machine}", json={"name": token[:20]}, headers={"X-CSRF-Token": token}
        )
        assert answer.status_code == 200, answer.text
