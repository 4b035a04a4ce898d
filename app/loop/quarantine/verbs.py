"""Acts on a part that is set aside: declared once, drawn on its page and as JSON."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.language.i18n import _
from app.loop.quarantine import actions, queries, wording
from app.loop.quarantine.queries import PartRow
from app.loop.quarantine.schemas import MeasuredAgainIn
from app.web.fields import ReasonIn
from app.web.verb import Size, Verb


@dataclass(frozen=True)
class OfPart:
    """A part by its number in a quarantine, and who acts on it."""

    session: Session
    quarantine: int
    number: int
    caller: Caller

    @property
    def row(self) -> PartRow:
        """It as it is now. Raises `NotFound`."""
        return queries.part(self.session, queries.quarantine(self.session, self.quarantine).quarantine, self.number)

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number and its name."""
        part = self.row.part
        name = wording.part_name(part.part, part.part_to) if part.part else _("reading {n}").format(n=part.sequence)
        return {"number": self.number, "part": name, "where": self.row.characteristic.name}


def release_part(on: OfPart, given: ReasonIn) -> PartRow:
    """Release a part by the word of an engineer, with the reason. An operator releases it by measuring it again."""
    return actions.decide(on.session, on.quarantine, on.number, "released", given.reason, on.caller)


def scrap_part(on: OfPart, given: ReasonIn) -> PartRow:
    """Scrap a part, with the reason."""
    return actions.decide(on.session, on.quarantine, on.number, "scrapped", given.reason, on.caller)


def measure_part_again(on: OfPart, given: MeasuredAgainIn) -> PartRow:
    """Decide about a part by its size: in tolerance it is released, outside it is scrapped.

    A size that lies nearer to a limit than the measuring uncertainty of the quarantine decides nothing: 422.
    """
    return actions.measure_again(on.session, on.quarantine, on.number, given.measured, given.reason, on.caller)


def _decided_so(status: str | None) -> Any:
    """After a `Conflict`: tells if the caller had decided the same before; None: by a size."""

    def own(on: OfPart) -> bool:
        part = on.row.part
        same = part.remeasured is not None if status is None else part.status == status and part.remeasured is None
        return bool(part.decided_by == on.caller.name and same)

    return own


PART: tuple[Verb[OfPart, Any], ...] = (
    Verb(
        name="measure",
        when=("open",),
        body=MeasuredAgainIn,
        act=measure_part_again,
        own=_decided_so(None),
        word=lambda: _("Measured again"),
        title=lambda _on: _("{part} was measured again?"),
        follows=lambda _on: [_("In tolerance it is released, outside it is scrapped. Size and reason stay on record.")],
        size=lambda _on: Size("measured", _("Size found"), "", needed=True),
        reasons=lambda: [_("Micrometer"), _("CMM"), _("Plug gauge"), _("On the machine again")],
        fits=lambda on: on.row.part.part_to is None,
        said=lambda: _("Part {n} was measured again; it is decided."),
    ),
    Verb(
        name="release",
        when=("open",),
        body=ReasonIn,
        act=release_part,
        role="engineer",
        own=_decided_so("released"),
        word=lambda: _("Release"),
        title=lambda _on: _("Release {part}?"),
        follows=lambda _on: [_("It counts as good without another measurement. The reason stays on record.")],
        reasons=lambda: [
            _("Fits its mating part"),
            _("Concession by the customer"),
            _("Measured elsewhere"),
        ],
        said=lambda: _("Part {n} is released."),
    ),
    Verb(
        name="scrap",
        when=("open",),
        body=ReasonIn,
        act=scrap_part,
        own=_decided_so("scrapped"),
        word=lambda: _("Scrap"),
        title=lambda _on: _("Scrap {part}?"),
        follows=lambda _on: [_("It is out for good. The reason stays on record.")],
        reasons=lambda: [_("Out of tolerance"), _("Measuring it costs more"), _("Surface damaged")],
        said=lambda: _("Part {n} is scrapped."),
    ),
)
