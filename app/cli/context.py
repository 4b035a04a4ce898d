"""The option ``--context``: only readings that say this in their context."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from app.language.i18n import _

if TYPE_CHECKING:
    from app.core.context import Chosen

OfContext = Annotated[
    list[str] | None,
    typer.Option(
        "--context",
        help="Only readings that say this in their context: order=A-4711; may be named more than once.",
        metavar="FIELD=VALUE",
        show_default="all readings",
    ),
]


def chosen_context(pairs: Sequence[str] | None, *, aqdef: bool = False) -> "Chosen":
    """The context as it was typed. aqdef: none can be chosen. Raises `Invalid` for a field that is not there."""
    from app.views.reports.request import context_of

    if aqdef and pairs:
        raise typer.BadParameter(_("AQDEF is written of all readings; choose csv or ndjson."), param_hint="--context")
    said: dict[str, str] = {}
    for pair in pairs or ():
        field, sign, value = (each.strip() for each in pair.partition("="))
        if not sign or not value or said.setdefault(field, value) != value:
            raise typer.BadParameter(
                _("write it as order=A-4711, each field once; this is {text}").format(text=repr(pair[:60])),
                param_hint="--context",
            )
    return context_of(said)
