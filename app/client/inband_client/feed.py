"""Server-sent events, from bytes to values. Pure."""

import json
from collections.abc import Iterator
from typing import Any

from inband_client.values import Event, Unreadable, read

HEARTBEAT = "heartbeat"
SILENCE = 15.0  # s; the server sends something every five, so a line that is silent for longer is dead
PAUSE = 2.0  # s until one comes back, unless the server says another


class Feed:
    """A stream of events, as far as it has come in. last: number to resume after; pause: seconds until one comes back after a cut."""

    def __init__(self, after: int | None) -> None:
        self.last = after
        self.pause = PAUSE
        self.cut()

    @property
    def headers(self) -> dict[str, str]:
        """Headers of the request that resumes here."""
        resume = {} if self.last is None else {"Last-Event-ID": str(self.last)}
        return {"Accept": "text/event-stream", "Cache-Control": "no-store"} | resume

    def cut(self) -> None:
        """Forget a half event: the line was cut, and what it began comes again."""
        self._rest = b""
        self._fields: dict[str, str] = {}

    def events(self, chunk: bytes) -> Iterator[Event]:
        """Events that are complete with these bytes."""
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        for line in lines:
            text = line.removesuffix(b"\r").decode("utf-8", "replace")
            if text:
                self._take(text)
            elif (event := self._complete()) is not None:
                yield event

    def _take(self, line: str) -> None:
        name, _colon, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "data":
            value = f"{self._fields['data']}\n{value}" if "data" in self._fields else value
        if name == "retry" and value.isascii() and value.isdigit():
            self.pause = min(int(value[:9]) / 1000, 60.0)
        self._fields[name] = value

    def _complete(self) -> Event | None:
        taken, self._fields = self._fields, {}
        number = taken.get("id", "")
        event_id = int(number) if number.isascii() and number.isdigit() and len(number) < 19 else None
        if event_id is not None:
            self.last = event_id
        if "event" not in taken and "data" not in taken:
            return None
        kind = taken.get("event", "message")
        return _event(kind, event_id, taken.get("data", ""))


def _event(kind: str, event_id: int | None, data: str) -> Event:
    try:
        content: Any = json.loads(data)
    except ValueError:
        content = None
    said = {"kind": kind, "event_id": event_id}
    if not isinstance(content, dict):
        return Event(kind=kind, event_id=event_id)
    try:
        return read(Event, content | said)
    except Unreadable:  # a field has another type than today: it is reported all the same
        return Event(kind=kind, event_id=event_id, extra=content)
