"""Everything that can be refused, and how it is said.

    InbandError
    ├── NotSignedIn        401  no key or session, or an unknown one
    ├── NotAllowed         403  known, but not yours to do
    ├── NotFound           404
    ├── MethodNotAllowed   405  with Allow
    ├── Conflict           409  the state of things does not permit it
    ├── ChangedMeanwhile   412  If-Match names a state that is gone
    ├── TooLarge           413
    ├── Invalid            422  the payload; `errors` names each field
    ├── TooManyRequests    429  with Retry-After
    ├── DatabaseAway       503  with Retry-After; nothing was stored
    │   ├── Busy           503  other work holds what is needed, such as the machine; nothing was stored
    │   └── DiskFull       503  of the server; nothing was stored
    ├── Compiling          503  /health/ready alone: the first start after an installation or upgrade
    ├── ServerEnding       503  it does not wait for this request any longer
    ├── OutcomeUnknown     503  the database went away during the commit; send again with the same key
    └── Unexpected         500  an unhandled error; its trace is in the log under the id of the request

Each carries what is wrong (`detail`), where (`errors`) and what to do about it (`what_to_do`), in words
that a machinist understands. The web layer makes RFC 9457 problem documents or problem pages of them.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Self

from app.language.i18n import _
from app.logs import REQUEST

PROBLEM_JSON = "application/problem+json"
"""Media type of RFC 9457."""


def for_people(what_to_do: str | None) -> str:
    """The advice without the calls of the API in it, which are of no use to a person at a page.

    >>> for_people("Check the key; GET /api/v1/machines lists them.")
    'Check the key.'
    """
    sentences = re.split(r"(?<=[.;])\s+", what_to_do or "")
    kept = " ".join(sentence for sentence in sentences if "/api/" not in sentence)
    return f"{kept[:-1]}." if kept.endswith(";") else kept


class FieldError(NamedTuple):
    """Error of one field, e.g. ``parameters.averaging_limit`` or ``[17].measured``."""

    field: str
    message: str


class InbandError(Exception):
    """Base of all; never raised itself."""

    status = 500
    kind = "error"
    title = "Something went wrong"

    def __init__(
        self,
        detail: str,
        what_to_do: str | None = None,
        *,
        errors: Iterable[FieldError] = (),
        retry_after: int | None = None,
        **more: Any,
    ) -> None:
        super().__init__(detail)
        self.detail = detail
        self.what_to_do = what_to_do
        self.errors = list(errors)
        self.retry_after = retry_after
        self.more = more

    @property
    def headers(self) -> dict[str, str]:
        """Headers that belong to the answer."""
        return {} if self.retry_after is None else {"Retry-After": str(self.retry_after)}

    @property
    def advice(self) -> str:
        """The remedy, for a person at a page; empty where there is none."""
        return for_people(self.what_to_do)

    def as_problem(self) -> dict[str, Any]:
        """The RFC 9457 problem document, with the id of the request that is being answered."""
        problem: dict[str, Any] = {
            "type": f"urn:inband:problem:{self.kind}",
            "title": self.title,
            "status": self.status,
            "detail": self.detail,
            "errors": [error._asdict() for error in self.errors],
        }
        if self.what_to_do:
            problem["what_to_do"] = self.what_to_do
        if (request := REQUEST.get()) is not None:
            problem["request_id"] = request
        return problem | self.more


class NotSignedIn(InbandError):
    """No key or session came with the request, or one that is not known (any more)."""

    page = "/sign-in"  # where people are led
    status = 401
    kind = "not-signed-in"
    title = "Not signed in"

    @property
    def headers(self) -> dict[str, str]:
        """Say how one signs in, as RFC 9110 wants it of a 401."""
        return {"WWW-Authenticate": "Bearer"}


class NotAllowed(InbandError):
    """The caller is known, but may not do this."""

    status = 403
    kind = "not-allowed"
    title = "Not allowed"


class NotFound(InbandError):
    """There is no such thing."""

    status = 404
    kind = "not-found"
    title = "Not found"


class MethodNotAllowed(InbandError):
    """The address is right, the method is not."""

    status = 405
    kind = "method-not-allowed"
    title = "Method not allowed"

    @property
    def headers(self) -> dict[str, str]:
        """Say which methods are."""
        return {"Allow": str(self.more.get("allowed", ""))}


class Conflict(InbandError):
    """The present state does not permit it: taken key, decided correction, acknowledged alarm."""

    status = 409
    kind = "conflict"
    title = "Conflicts with the present state"


class ChangedMeanwhile(InbandError):
    """Somebody has changed it since the state that If-Match names; nothing was changed by this request."""

    status = 412
    kind = "changed-meanwhile"
    title = "Changed meanwhile"


class TooLarge(InbandError):
    """More bytes or items than are taken at once."""

    status = 413
    kind = "too-large"
    title = "Too large"


class Invalid(InbandError):
    """The payload cannot be used; nothing of it was stored."""

    status = 422
    kind = "invalid"
    title = "The request cannot be used as it is"

    @classmethod
    def at(cls, field: str, wrong: str, *, do: str | None = None) -> Self:
        """Refusal of one field. wrong: without a capital and a full stop, for it follows the name of the field."""
        return cls(f"{field}: {wrong}.", do, errors=[FieldError(field, wrong)])

    @classmethod
    def of(cls, errors: Sequence[FieldError], do: str | None = None, *, said: int | None = None) -> Self:
        """Refusal of several fields. said: how many of them the sentence names; all by default."""
        return cls("; ".join(f"{field}: {message}" for field, message in errors[:said]), do, errors=errors)

    def as_problem(self) -> dict[str, Any]:
        """With the usual advice where it has none of its own."""
        usual = {} if self.what_to_do else {"what_to_do": _("Correct the named fields and send it again.")}
        return super().as_problem() | usual


class TooManyRequests(InbandError):
    """Slower, please."""

    status = 429
    kind = "too-many-requests"
    title = "Too many requests"


class DatabaseAway(InbandError):
    """The database cannot be reached; nothing was stored."""

    status = 503
    kind = "database-away"
    title = "The database is unreachable"

    def __init__(self, detail: str | None = None) -> None:
        super().__init__(
            detail or "The database cannot be reached at the moment. Nothing of this request was stored.",
            "Send the request again, with the same key, after the time in Retry-After.",
            retry_after=2,
        )


class Busy(DatabaseAway):
    """Other work holds what the request needs, such as its machine, for longer than it can wait; nothing was stored."""

    kind = "busy"
    title = "Other work holds what is needed"

    def __init__(self, machine: str | None = None) -> None:
        held = "what this request needs" if machine is None else f"the machine {machine}"
        super().__init__(
            f"Other work has held {held} for longer than the request can wait. Nothing of this request was stored."
        )


class DiskFull(DatabaseAway):
    """The disk of the server, or of its database, is full; nothing was stored."""

    kind = "disk-full"
    title = "The disk is full"

    def __init__(self) -> None:
        super().__init__("The disk of the server is full. Nothing of this request was stored.")
        self.what_to_do = (
            "Make room on it. Send the request again, with the same key, after the time in Retry-After: "
            "nothing needs to be started again."
        )
        self.retry_after = 10


class Compiling(InbandError):
    """The server runs, and compiles what decides readings: once after an installation or upgrade. They are taken, and wait for it."""

    status = 503
    kind = "compiling"
    title = "Not ready: compiling"

    def __init__(self) -> None:
        super().__init__(
            "Not ready: the server compiles what decides readings, once after an installation or upgrade. Until then a reading waits.",
            "Wait; nothing needs to be started again.",
            retry_after=2,
        )


class ServerEnding(InbandError):
    """The server ends, and did not wait for this request any longer. A change may have been stored all the same."""

    status = 503
    kind = "server-ending"
    title = "The server is ending"

    def __init__(self) -> None:
        super().__init__(
            "The server is ending and cannot wait for this request any longer.",
            "Send it again, with the same key, after the time in Retry-After.",
            retry_after=5,
        )


class OutcomeUnknown(InbandError):
    """The connection broke during the commit and the database has not come back to say how it ended."""

    status = 503
    kind = "outcome-unknown"
    title = "The database went away during the commit"

    def __init__(self, what_to_do: str | None = None) -> None:
        super().__init__(
            "The connection to the database was lost while this was being committed, and in time nobody could be asked "
            "whether it was.",
            what_to_do
            or "Send it again with the same key: if it was stored you get its answer, if not it is stored now.",
            retry_after=2,
        )


class Unexpected(InbandError):
    """An unhandled error. Its trace is in the log, under the id of the request."""

    kind = "unexpected"
    title = "Something went wrong on the server"
