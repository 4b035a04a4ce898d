"""Largest bodies of requests, declared where a route is: how many bytes, and by which callers.

    @router.post("/import")
    @takes(64 * MEGABYTE, by="engineer")
    async def send(...): ...

Nothing is read of a body before it is known who sends it; see `app.access.bodies`.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeVar

from app.errors import TooLarge
from app.language.i18n import _

KILOBYTE = 1000
MEGABYTE = 1_000_000
FEW = 8 * KILOBYTE
"""Of a stranger, on the pages that are for everybody: a name, a password, a code."""
FORM = 64 * KILOBYTE
"""Of a device that is bound to a machine."""

By = Literal["anybody", "caller", "viewer", "operator", "engineer", "admin"]


class Takes(NamedTuple):
    """Body that a route takes: at most N bytes. by: the least role of those who may send more than `DEFAULT`.

    pictures: it holds them, and comes from devices that are bound to a machine as well.
    """

    most: int
    by: By
    pictures: bool = False


DEFAULT = Takes(MEGABYTE, "caller")
Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])
_declared: dict[Callable[..., Any], Takes] = {}


def takes(most: int, by: By = "caller", *, pictures: bool = False) -> Callable[[Endpoint], Endpoint]:
    """Declare the largest body of a route, under the decorator of its router. by: "anybody" for what strangers may send."""

    def declare(endpoint: Endpoint) -> Endpoint:
        _declared[endpoint] = Takes(most, by, pictures)
        return endpoint

    return declare


def taken_by(endpoint: Callable[..., Any]) -> Takes | None:
    """Return what was declared for the function of a route."""
    return _declared.get(endpoint)


def too_large(most: int, *, pictures: bool = False) -> TooLarge:
    """The refusal of a body of more bytes than these."""
    size = f"{most // MEGABYTE} MB" if most >= MEGABYTE else f"{most // KILOBYTE} kB"
    return TooLarge(
        _("The request is larger than the {limit} that are taken here.").format(limit=size),
        _("Send smaller pictures, or fewer at once.") if pictures else _("Send it in several smaller requests."),
    )
