"""Attempts of one call: what an answer says, what may be tried again, and after how long. Pure but for the clock it is given."""

import logging
import random
import ssl
from collections.abc import Callable
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from http import HTTPStatus
from typing import Any, TypeVar

import httpx

from inband_client.calls import Call
from inband_client.errors import BY_STATUS, ProblemError, Unavailable, Untrusted, WrongField
from inband_client.values import Unreadable

log = logging.getLogger("inband_client")
Answer = TypeVar("Answer")
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 10.0  # s; doubled after each attempt
LONGEST_ASKED = 300.0  # s, of Retry-After: more is a proxy's mistake
NOT_SENT = (httpx.ConnectError, httpx.ConnectTimeout, httpx.PoolTimeout, httpx.ProxyError)
NOTHING_STORED = {"busy", "database-away", "disk-full", "too-many-requests"}
LONGEST_QUOTE = 200


class Attempts:
    """The attempts of one call. patience: seconds from the first on within which another one may begin; None for ever."""

    def __init__(
        self,
        call: str,
        *,
        repeat: bool,
        patience: float | None,
        clock: Callable[[], float],
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self._call = call
        self._repeat = repeat
        self._patience = patience
        self._clock = clock
        self._jitter = jitter
        self.begin()

    def begin(self) -> None:
        """Count from now on, as after a success."""
        self._began = self._clock()
        self._count = 0
        self._sent = False

    def failed(self, error: httpx.RequestError) -> float:
        """Seconds until the next attempt, after one without an answer. Raises `Unavailable` or `Untrusted`."""
        if (wrong := _certificate(error)) is not None:
            raise Untrusted(
                self._call,
                f"The certificate of {error.request.url.host} is not trusted: {wrong}.",
                what_to_do="Check the address; if it is right, name the authority that signed it: Client(…, verify='ca.pem').",
            ) from error
        words = str(error) or {True: "no answer in time"}.get(isinstance(error, httpx.TimeoutException), "")
        sent = not isinstance(error, NOT_SENT)
        return self._next(words or type(error).__name__, error, sent=sent, asked=None, more={})

    def refused(self, response: httpx.Response) -> float:
        """Seconds until the next attempt, after an answer that is no success. Raises `ProblemError` if there is to be none."""
        problem = problem_of(self._call, response)
        if not _passes(response.status_code):
            raise problem
        more: dict[str, Any] = {"status": problem.status, "title": problem.title, "request_id": problem.request_id}
        more |= {"document": problem.document, "retry_after": problem.retry_after}
        sent = response.status_code != HTTPStatus.TOO_MANY_REQUESTS and problem.kind not in NOTHING_STORED
        words = f"{response.status_code} {problem.detail}"
        return self._next(words, problem, sent=sent, asked=problem.retry_after, more=more)

    def _next(self, words: str, cause: Exception, *, sent: bool, asked: float | None, more: dict[str, Any]) -> float:
        self._sent = self._sent or sent
        self._count += 1
        if sent and not self._repeat:
            raise Unavailable(
                self._call,
                f"It may have been carried out, but no answer tells so: {words}.",
                what_to_do="Look whether it was stored before you send it again.",
                may_have_happened=True,
                **more,
            ) from cause
        pause = min(FIRST_PAUSE * 2.0 ** min(self._count - 1, 20), LONGEST_PAUSE) * (0.5 + self._jitter() / 2)
        pause = max(pause, min(asked or 0.0, LONGEST_ASKED))
        waited = self._clock() - self._began
        if self._patience is not None and waited + pause > self._patience:
            raise Unavailable(
                self._call,
                f"No answer after {self._count} attempts in {waited:.0f} s: {words}."
                if self._count > 1
                else f"No answer: {words}.",
                what_to_do="Check that the server runs and that its address is right; then send it again.",
                may_have_happened=self._sent,
                **more,
            ) from cause
        log.info("%s: %s; again in %.1f s", self._call, words, pause)
        return pause


def _passes(status: int) -> bool:
    """Tell if waiting may help."""
    return status >= 500 or status in {HTTPStatus.TOO_MANY_REQUESTS, HTTPStatus.REQUEST_TIMEOUT}


def answer_of(call: Call[Answer], response: httpx.Response) -> Answer:
    """The answer that a success holds. Raises `ProblemError` for one that does not come from an Inband server."""
    try:
        return call.read(response.json() if response.content else None)
    except ValueError as error:  # no JSON, no text, `Unreadable`
        wrong = str(error) if isinstance(error, Unreadable) else f"It is no JSON: {_quoted(response)}"
        raise ProblemError(
            str(call),
            f"The answer cannot be read. {wrong}",
            status=response.status_code,
            what_to_do="Check that the address is that of an Inband server, and that no proxy answers in its place.",
        ) from error


def problem_of(call: str, response: httpx.Response) -> ProblemError:
    """The error that an answer is; also one of a proxy, which sends no problem document."""
    status = response.status_code
    try:
        document = response.json()
    except ValueError:
        document = None
    if not isinstance(document, dict):
        document = {}
    title, detail, what_to_do = document.get("title"), document.get("detail"), document.get("what_to_do")
    if response.is_redirect:
        detail = f"The server sends this call to another address: {response.headers.get('Location')}."
        what_to_do = "Use that address in place of this one, with https if it has it."
    request_id = document.get("request_id") or response.headers.get("X-Request-ID")
    return BY_STATUS.get(status, ProblemError)(
        call,
        detail if isinstance(detail, str) else _quoted(response),
        status=status,
        title=title if isinstance(title, str) else response.reason_phrase,
        errors=_fields(document.get("errors")),
        what_to_do=what_to_do if isinstance(what_to_do, str) else None,
        request_id=request_id if isinstance(request_id, str) else None,
        retry_after=_asked_for(response),
        document=document,
    )


def _fields(errors: Any) -> list[WrongField]:
    named = [each for each in errors if isinstance(each, dict)] if isinstance(errors, list) else []
    return [WrongField(str(each.get("field", "")), str(each.get("message", ""))) for each in named]


def _quoted(response: httpx.Response) -> str:
    text = " ".join(response.text.split())
    return text if len(text) <= LONGEST_QUOTE else f"{text[:LONGEST_QUOTE]}…"


def _asked_for(response: httpx.Response) -> float | None:
    """The seconds of Retry-After, which is a number or a date."""
    said = response.headers.get("Retry-After", "").strip()
    if said.isascii() and said.isdigit():
        return float(said[:9])
    try:
        moment = parsedate_to_datetime(said)
    except ValueError:
        return None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return max(0.0, (moment - datetime.now(UTC)).total_seconds())


def _certificate(error: BaseException | None) -> str | None:
    """Return what is wrong with the server's certificate, if that is the cause."""
    while error is not None:
        if isinstance(error, ssl.SSLCertVerificationError):
            return error.verify_message
        error = error.__cause__ or error.__context__
    return None
