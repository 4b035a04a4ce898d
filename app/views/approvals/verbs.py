"""Approving all corrections of one tool together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.errors import NotFound
from app.language.formatting import mm, read_um
from app.language.i18n import _, ngettext
from app.loop.tables.tools import Correction
from app.loop.tools import actions, queries
from app.loop.tools.schemas import DecisionsIn
from app.loop.tools.verbs import OfMachine
from app.views.approvals import queries as queue
from app.web.verb import Said, Verb


@dataclass(frozen=True)
class OfTool(OfMachine):
    """The corrections of a tool that await approval. numbers: those that were shown."""

    numbers: tuple[int, ...] = ()

    @property
    def group(self) -> queue.Group:
        """Them as they are now. Raises `NotFound` when none waits any more."""
        queries.tool(self.session, self.machine, self.number)
        group = queue.group_of(self.session, self.machine, self.number)
        if group is None or not group.approvable:
            raise NotFound(
                _("No correction of tool {tool} awaits approval any more.").format(tool=self.number),
                _("Another user has decided. Go back to the list of approvals."),
            )
        return group

    @property
    def values(self) -> Mapping[str, Any]:
        """Tool, numbers, their sum, and the offset before and after."""
        group = self.group
        return {
            "tool": self.number,
            "n": len(group.approvable),
            "numbers": ", ".join(map(str, group.approvable)),
            "total": read_um(group.total, group.half),
            "offset": mm(group.tool.offset),
            "after": mm(group.after),
        }

    @property
    def decided(self) -> Correction:
        """The first of those shown that a person has decided about meanwhile."""
        shown = (queries.correction(self.session, self.machine, number) for number in self.numbers)
        return next(correction for correction in shown if correction.status != "awaiting_approval")


def shown_in(form: Mapping[str, str]) -> tuple[int, ...]:
    """Numbers of the corrections that the question has shown."""
    return tuple(int(each) for each in form.get("numbers", "").split() if each.isdecimal() and len(each) < 11)


def _approve(on: OfTool, decision: DecisionsIn) -> Said:
    actions.approve_all(on.session, on.machine, decision.numbers, decision.reason, on.caller)
    return Said("approve-all", on.number)


def _approving(on: OfTool) -> list[str]:
    count = len(on.group.approvable)
    return [
        ngettext("Correction {numbers}: {total}.", "Corrections {numbers}: {total} in all.", count).format(**on.values),
        _("The machine fetches them; the offset of tool {tool} goes from {offset} to {after}.").format(**on.values),
    ]


APPROVE_ALL: Verb[OfTool, DecisionsIn] = Verb(
    name="approve-all",
    body=DecisionsIn,
    act=_approve,
    own=lambda on: on.decided.decided_by == on.caller.name and on.decided.status == "pending",
    word=lambda: _("Approve all"),
    title=lambda on: ngettext(
        "Approve {n} correction of tool {tool}?", "Approve {n} corrections of tool {tool}?", len(on.group.approvable)
    ),
    follows=_approving,
    reasons=lambda: [_("As expected"), _("Part measured, agrees"), _("Process is known")],
    likely=lambda: _("As expected"),
    hidden=lambda on: {"numbers": " ".join(map(str, on.group.approvable))},
    said=lambda: _("All that awaited approval for tool {n} is approved; it waits for the machine."),
)
