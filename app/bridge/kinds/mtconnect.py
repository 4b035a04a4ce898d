"""MTConnect: program, tool and part count of a machine as context of its readings. No control, and never a correction.

The agent keeps the last observations in a ring and numbers them; ``sample`` answers those from a number on. Another instanceId
means that the agent has restarted and counts from 1. What the agent did not tell stays unknown: a reading gets no part then.
"""

import asyncio
import bisect
import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Final, Literal
from urllib.parse import quote
from xml.parsers import expat

import httpx
import msgspec

from app.bridge.links import Received

log = logging.getLogger(__name__)
COUNT: Final = 1000
"""Observations in one answer, at most."""
LARGEST: Final = 20_000_000  # bytes of an answer
REMEMBERED: Final = 2000  # changes of the part
LONGEST_PAUSE: Final = 30.0  # s between attempts
GAP_SHOWN: Final = timedelta(hours=1)
LONGEST_PART: Final = 128
WHOLE_SECONDS: Final = timedelta(seconds=2)
"""Agents write the time of an answer in whole seconds: a smaller difference is no clock that is wrong."""
ELEMENTS: Final[dict[str, tuple[str, ...]]] = {
    "part": ("PartUniqueId", "PartCount", "PartId"),
    "program": ("Program",),
    "tool": ("ToolNumber", "ToolAssetId", "ToolId"),
}
"""Elements of an answer that tell each, the best first; one that is UNAVAILABLE leaves it to the next until it has had a value."""
SUBTYPES: Final[dict[str, tuple[str, ...]]] = {
    "part": ("", "ALL"),
    "program": ("", "ALL", "MAIN", "ACTIVE"),
    "tool": ("", "ALL"),
}
"""Subtypes that count, the best first: a TARGET is no count, and the program that is ACTIVE may be a subprogram."""
AGENT: Final = "Agent"
"""The device that newer agents have for themselves."""


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The context of one machine.

    url: of the agent. device: name or UUID, needed where the agent has several. every: seconds between two questions.
    patience: seconds that an answer may take. part, program, tool: the dataItemId, where a device has several that fit.
    """

    kind: Literal["mtconnect"]
    url: str
    device: str | None = None
    every: Annotated[float, msgspec.Meta(gt=0)] = 1.0
    patience: Annotated[float, msgspec.Meta(gt=0)] = 10.0
    part: str | None = None
    program: str | None = None
    tool: str | None = None


class AgentError(Exception):
    """The agent cannot be used now; the words say why and what to do."""


@dataclass(frozen=True, slots=True)
class Observation:
    """One value. value: None where the agent says UNAVAILABLE."""

    item: str
    element: str
    subtype: str
    at: str
    value: str | None
    device: str = ""


@dataclass(slots=True)
class Answer:
    """One document. first, next, last: numbers of the oldest observation kept, the one to ask for, and the newest."""

    instance: str = ""
    created: str = ""
    first: int = 0
    next: int = 0
    last: int = 0
    error: str = ""
    observations: list[Observation] = field(default_factory=list)


class _Reader:
    """Reads a document piece by piece. A DOCTYPE ends it: entities could make a small document endless."""

    def __init__(self) -> None:
        self.answer = Answer()
        self.root = ""
        self._size = 0
        self._device = ""
        self._open: tuple[str, dict[str, str]] | None = None
        self._text: list[str] = []
        self._parser = expat.ParserCreate(namespace_separator=" ")
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text.append

    def feed(self, piece: bytes, *, last: bool = False) -> None:
        """Read on. Raises `AgentError`, `expat.ExpatError` or `ValueError`."""
        self._size += len(piece)
        if self._size > LARGEST:
            raise AgentError(f"is larger than {LARGEST / 1e6:g} MB")
        self._parser.Parse(piece, last)

    def _doctype(self, *_: object) -> None:
        raise AgentError("has a DOCTYPE, which no agent sends")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        local = name.rpartition(" ")[2]
        self.root = self.root or local
        if local == "Header":
            self.answer.instance = attributes.get("instanceId", "")
            self.answer.created = attributes.get("creationTime", "")
            for word in ("first", "next", "last"):
                setattr(self.answer, word, int(attributes.get(f"{word}Sequence", 0)))
        elif local == "DeviceStream":
            self._device = attributes.get("name") or attributes.get("uuid", "")
        elif "dataItemId" in attributes or local == "Error":
            self._open = local, attributes
        self._text.clear()

    def _end(self, name: str) -> None:
        if self._open is None or name.rpartition(" ")[2] != self._open[0]:
            return
        (element, attributes), self._open = self._open, None
        text = "".join(self._text).strip()
        if element == "Error":
            self.answer.error = f"{attributes.get('errorCode', '')} {text}".strip()
            return
        value = None if text in {"", "UNAVAILABLE"} else text
        self.answer.observations.append(
            Observation(
                attributes["dataItemId"],
                element,
                attributes.get("subType", ""),
                attributes.get("timestamp", ""),
                value,
                self._device,
            )
        )


class Context:
    """Context of one machine, as the agent tells it. `run` asks it; the other methods answer at once from memory."""

    def __init__(self, machine: str, settings: Settings) -> None:
        self.machine = machine
        self.settings = settings
        self.base = settings.url.rstrip("/") + (f"/{quote(settings.device, safe='')}" if settings.device else "")
        self.values: dict[str, str | None] = {}
        self.trouble: str | None = None
        self.gaps = 0
        self._gap: tuple[datetime, str] | None = None
        self.unclear: list[str] = []
        self._items: dict[str, tuple[str, int]] = {}
        """What each data item tells, and its rank among those that tell it."""
        self._ranks: dict[str, int] = {}
        """The rank of the data item that tells each now: the best that has had a value."""
        self._instance: str | None = None
        self._next = 0
        self._until: datetime | None = None
        self._trusted = timedelta(seconds=2 * settings.every + 1)  # an answer holds until the next but one is due
        self._executions: dict[str, str | None] = {}  # of each path of the control
        self._parts: list[tuple[datetime, int, str | None]] = []
        self._noted = 0

    async def run(self) -> None:
        """Ask the agent until cancelled; whatever fails is said, and tried again."""
        pause = self.settings.every
        async with self.client() as http:
            while True:
                try:
                    behind = await self.poll(http)
                    self._say(None)
                    pause = 0.0 if behind else self.settings.every
                except AgentError as error:
                    self._say(str(error))
                    pause = min(2 * max(pause, self.settings.every), LONGEST_PAUSE)
                await asyncio.sleep(pause)

    def client(self) -> httpx.AsyncClient:
        """The client to ask with: no proxy of the office, and no way to another address."""
        return httpx.AsyncClient(
            timeout=self.settings.patience, trust_env=False, headers={"Accept": "application/xml, text/xml"}
        )

    def with_parts(self, received: Sequence[Received]) -> Sequence[Received]:
        """The same readings; those without a part have the one that the agent reported for the time of their measurement."""
        return [
            replace(each, body=each.body | {"part": part})
            if not each.body.get("part") and (part := self.part_at(each.body.get("measured_at"))) is not None
            else each
            for each in received
        ]

    def part_at(self, at: object) -> str | None:
        """The part at a time (ISO 8601 with offset); None if the agent has not reported it, or has been unreachable since."""
        moment = _moment(at) if isinstance(at, str) else None
        if moment is None or self._until is None or moment > self._until + self._trusted:
            return None
        index = bisect.bisect_right(self._parts, moment, key=lambda entry: entry[0])
        return self._parts[index - 1][2] if index else None

    def running(self) -> bool | None:
        """Tell if the control runs a program now: one of its paths does. None if the agent does not say, or has been unreachable."""
        recent = self._until is not None and datetime.now(UTC) <= self._until + self._trusted
        states = [value for value in self._executions.values() if value is not None]
        return "ACTIVE" in states if states and recent else None

    def summary(self) -> str:
        """One sentence for the heartbeat."""
        if self.trouble:
            return self.trouble
        known = ", ".join(f"{name} {value[:60]}" for name in ELEMENTS if (value := self.values.get(name)))
        known_of_it = f"MTConnect: {known or 'program, tool and part are unavailable'}."
        recent = self._gap is not None and datetime.now(UTC) - self._gap[0] < GAP_SHOWN
        return " ".join([known_of_it, *self.unclear, *([self._gap[1]] if recent and self._gap else [])])

    def lacking(self) -> tuple[list[str], list[str]]:
        """Names without a data item at the device, and those whose data item is UNAVAILABLE, once the agent has answered."""
        there = {name for name, _ in self._items.values()}
        named = {name for name in ELEMENTS if any(f"context.{name}." in each for each in self.unclear)}
        silent = [name for name in ELEMENTS if name in there and self.values.get(name) is None]
        return [name for name in ELEMENTS if name not in there | named], silent

    async def poll(self, http: httpx.AsyncClient) -> bool:
        """Ask once; whether more waits at the agent. Raises `AgentError`."""
        if self._instance is None:
            await self._begin(http, again=False)
            return False
        asked = datetime.now(UTC)
        answer = await self._ask(http, "sample", {"from": self._next, "count": COUNT})
        if answer.instance != self._instance:
            self._note_gap("The agent was restarted")
            await self._begin(http, again=True)
            return True
        if answer.error.startswith("OUT_OF_RANGE"):
            self._note_gap("The agent's buffer had gone on before the bridge asked")
            await self._begin(http, again=False)
            return False
        self._refuse(answer)
        self._take(answer, asked)
        behind = self._next < answer.next <= answer.last
        self._next = max(self._next, answer.next)
        if not behind:
            self._until = asked
        return behind

    async def _begin(self, http: httpx.AsyncClient, *, again: bool) -> None:
        """Learn what holds now. again: the agent is new, and all that it keeps is wanted; else what comes from now on."""
        asked = datetime.now(UTC)
        answer = await self._ask(http, "current", {})
        self._refuse(answer)
        before, until = self.values.get("part"), self._until
        devices = sorted({each.device for each in answer.observations} - {AGENT})
        if self.settings.device is None and len(devices) > 1:
            raise AgentError(
                f"The MTConnect agent {self.base} has several devices ({', '.join(devices[:5])}): name the one of this machine"
                " as context.device."
            )
        known, self.unclear, self._items = self._items, [], {}
        for name in ELEMENTS:
            self._choose(name, answer.observations)
        if self._items != known:
            self._ranks.clear()
        self._ranks = self._best_ranks(answer.observations) | self._ranks
        self.values.clear()
        self._executions.clear()
        self._take(answer, asked)
        same = not again and before is not None and before == self.values.get("part")
        if until is not None and not (same and max(self._parts, key=lambda entry: entry[1])[0] <= until):
            self._note_part(until, None)  # unknown until the next one, but for a part that has not changed since
        self._instance, self._next = answer.instance, answer.first if again else answer.next
        self._until = asked

    def _choose(self, name: str, observations: list[Observation]) -> None:
        """Find the data items that tell part, program or tool, and rank them."""
        wanted = getattr(self.settings, name)
        if wanted is not None:
            if any(each.item == wanted for each in observations):
                self._items[wanted] = name, 0
            else:
                self.unclear.append(f"The device has no data item {wanted!r}: correct context.{name}.")
            return
        for element in ELEMENTS[name]:
            for subtype in SUBTYPES[name]:
                fitting = {each.item for each in observations if (each.element, each.subtype) == (element, subtype)}
                if len(fitting) > 1:
                    if name in self._best_ranks(observations):
                        return
                    listed = ", ".join(sorted(fitting)[:5])
                    self.unclear.append(f"Several data items tell the {name} ({listed}): name one as context.{name}.")
                    return
                for item in fitting:
                    self._items[item] = name, len(self._items)

    def _best_ranks(self, observations: Sequence[Observation]) -> dict[str, int]:
        """The rank of the best data item that has a value, of each that is reported."""
        found: dict[str, int] = {}
        for each in observations:
            if each.value is not None and each.item in self._items:
                name, rank = self._items[each.item]
                found[name] = min(rank, found.get(name, rank))
        return found

    def _take(self, answer: Answer, asked: datetime) -> None:
        created = _moment(answer.created)
        ahead = timedelta() if created is None else created - asked  # the agent's clock
        if abs(ahead) < WHOLE_SECONDS:
            ahead = timedelta()
        for each in answer.observations:
            if each.element == "Execution":
                self._executions[each.item] = each.value
            if (known := self._items.get(each.item)) is None:
                continue
            name, rank = known
            best = self._ranks.get(name)
            if rank != best and (each.value is None or (best is not None and rank > best)):
                continue  # another one tells it, or none yet
            self._ranks[name] = rank
            self.values[name] = each.value
            if name == "part":
                at = _moment(each.at)
                self._note_part(asked if at is None else min(at - ahead, asked), each.value)

    def _note_part(self, at: datetime, part: str | None) -> None:
        self._noted += 1
        bisect.insort(
            self._parts, (at, self._noted, part and part[:LONGEST_PART]), key=lambda entry: (entry[0], entry[1])
        )
        del self._parts[:-REMEMBERED]

    def _note_gap(self, why: str) -> None:
        self.gaps += 1
        at = datetime.now(UTC)
        self._gap = at, f"{why} ({at:%H:%M} UTC): parts in between may be unknown."
        log.warning("%s: MTConnect: %s", self.machine, self._gap[1])

    def _say(self, trouble: str | None) -> None:
        if trouble != self.trouble:
            log.log(
                logging.WARNING if trouble else logging.INFO,
                "%s: %s",
                self.machine,
                trouble or "the MTConnect agent answers",
            )
        self.trouble = trouble

    def _refuse(self, answer: Answer) -> None:
        if answer.error:
            raise AgentError(f"The MTConnect agent {self.base} refuses: {answer.error}. Look at url and device.")

    async def _ask(self, http: httpx.AsyncClient, what: str, query: dict[str, Any]) -> Answer:
        url = f"{self.base}/{what}"
        reader = _Reader()
        try:
            async with asyncio.timeout(self.settings.patience), http.stream("GET", url, params=query) as response:
                async for piece in response.aiter_bytes():
                    reader.feed(piece)
            reader.feed(b"", last=True)
        except TimeoutError as error:
            raise AgentError(
                f"The MTConnect agent {url} has not answered for {self.settings.patience:g} s; readings go on without it."
            ) from error
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise AgentError(
                f"The MTConnect agent {url} does not answer ({type(error).__name__}): is it running, is the address right?"
            ) from error
        except (expat.ExpatError, ValueError, AgentError) as error:
            raise AgentError(
                f"What {url} answers (status {response.status_code}) is not MTConnect: it {_why(error)}. Look at url."
            ) from error
        if reader.root not in {"MTConnectStreams", "MTConnectError"} or not reader.answer.instance:
            raise AgentError(f"What {url} answers is not MTConnect: it begins with {reader.root!r}. Look at url.")
        return reader.answer


def _why(error: Exception) -> str:
    return str(error) if isinstance(error, AgentError) else f"cannot be read ({error})"


def _moment(text: str) -> datetime | None:
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        return None
    return at.replace(tzinfo=UTC) if at.tzinfo is None else at
