"""Errors as exceptions that say what the server's problem document says.

ProblemError            the server will not do it, or its answer cannot be read
├── Unauthorized   401  no key, or one that is unknown or revoked
├── Forbidden      403  known, but not yours to do
├── NotFound       404
├── Conflict       409  the state of things does not permit it
├── TooLarge       413
├── Invalid        422  the payload; `errors` names each field
├── Untrusted           the server's certificate is not trusted
└── Unavailable         no answer as long as the client was patient, or none that may be asked for twice
Stopped                 `stop()` was called
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple


class WrongField(NamedTuple):
    """A field that cannot be used, such as ``parameters.averaging_limit`` or ``[17].measured``, and why."""

    field: str
    message: str


class Stopped(Exception):
    """The client was stopped while it waited. What was being sent may have been stored: send it again with the same key."""


class ProblemError(Exception):
    """A call that came to nothing.

    call: method and path. status: of HTTP, None where there was no answer. errors: the fields it is about. what_to_do: in
    words. request_id: names the request in the server's log. document: the whole problem document.
    """

    def __init__(
        self,
        call: str,
        detail: str,
        *,
        status: int | None = None,
        title: str = "",
        errors: Sequence[WrongField] = (),
        what_to_do: str | None = None,
        request_id: str | None = None,
        retry_after: float | None = None,
        document: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__(detail)
        self.call = call
        self.detail = detail
        self.status = status
        self.title = title
        self.errors = tuple(errors)
        self.what_to_do = what_to_do
        self.request_id = request_id
        self.retry_after = retry_after
        self.document = document or {}

    def __str__(self) -> str:
        """Say what was called, what is wrong, where, and what to do."""
        head = " ".join(str(part) for part in (self.status, self.title) if part)
        fields = "; ".join(f"{field}: {message}" for field, message in self.errors[:5] if message not in self.detail)
        said = [part if part.endswith((".", "!", "?")) else f"{part}." for part in (head, self.detail, fields) if part]
        return f"{self.call}: {' '.join([*said, self.what_to_do or '']).strip()}"

    @property
    def kind(self) -> str:
        """Last word of the document's `type`, such as ``database-away``; empty if an answer has none."""
        return str(self.document.get("type", "")).rpartition(":")[2]


class Unauthorized(ProblemError):
    """No key, or one that is unknown or revoked."""


class Forbidden(ProblemError):
    """The key is known, but this is not its to do."""


class NotFound(ProblemError):
    """There is no such thing."""


class Conflict(ProblemError):
    """The state of things does not permit it: a key that was used for another value, a correction decided already."""


class TooLarge(ProblemError):
    """More bytes or items than the server takes at once."""


class Invalid(ProblemError):
    """The payload cannot be used; nothing of it was stored."""


class Untrusted(ProblemError):
    """The certificate of the server is not trusted. Nothing was sent to it."""


class Unavailable(ProblemError):
    """No answer from the server for as long as the client was patient; `__cause__` is what came of the last attempt.

    may_have_happened: an attempt may have been carried out without its answer reaching us.
    """

    def __init__(self, call: str, detail: str, *, may_have_happened: bool, **more: Any) -> None:
        super().__init__(call, detail, **more)
        self.may_have_happened = may_have_happened


BY_STATUS: Mapping[int, type[ProblemError]] = {
    401: Unauthorized,
    403: Forbidden,
    404: NotFound,
    409: Conflict,
    413: TooLarge,
    422: Invalid,
}
