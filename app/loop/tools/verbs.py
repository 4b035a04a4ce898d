"""Acts on a correction, a tool and an average: one declaration each, drawn on every page, at stations and as JSON."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.plausibility import offset_warnings
from app.language.formatting import mm, read_um, typed_length, um
from app.language.i18n import _, ngettext
from app.loop.characteristics.correction_queries import open_corrections
from app.loop.tables.machines import Machine
from app.loop.tools import actions, applying, queries, sister_actions, wording
from app.loop.tools.actions import APPROVE, REJECT, RELEASE, Decided, Decision
from app.loop.tools.edge_schemas import SisterIn
from app.loop.tools.queries import AverageRow, CorrectionRow, ToolRow
from app.loop.tools.schemas import (
    AppliedIn,
    CorrectionDecisionIn,
    EmpiricalValueIn,
    RejectionIn,
    ToolChange,
    ToolEdit,
)
from app.web.verb import Said, Size, Verb, said


@dataclass(frozen=True)
class OfMachine:
    """Something of a machine by its number, and who acts on it."""

    session: Session
    machine: Machine
    number: int
    caller: Caller


class OfCorrection(OfMachine):
    """A correction."""

    @property
    def row(self) -> CorrectionRow:
        """It as it is now. Raises `NotFound`."""
        return queries.row_of(self.session, self.machine, queries.correction(self.session, self.machine, self.number))

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number, amount, tool, and the offset after it."""
        row = self.row
        return {
            "number": self.number,
            "amount": read_um(row.correction.amount, row.half),
            "tool": row.correction.tool_memory,
            "after": "–" if row.expected is None else mm(row.expected),
        }


class OfTool(OfMachine):
    """A location of the tool memory."""

    @property
    def row(self) -> ToolRow:
        """It as it is now. Raises `NotFound`."""
        queries.tool(self.session, self.machine, self.number)
        return queries.tools(self.session, self.machine, only=self.number)[0]

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number, offset, parts cut, and its sister."""
        row = self.row
        return {"tool": self.number, "offset": mm(row.tool.offset), "parts": row.parts, "sister": row.tool.sister}


class OfAverage(OfMachine):
    """A location of the average memory."""

    @property
    def row(self) -> AverageRow:
        """It as it is now. Raises `NotFound`."""
        queries.average(self.session, self.machine, self.number)
        return queries.averages(self.session, self.machine, only=self.number)[0]

    @property
    def values(self) -> Mapping[str, Any]:
        """Its location and running average."""
        return {"location": self.number, "average": um(self.row.memory.average)}


# --- corrections


def mark_applied(on: OfCorrection, applied: AppliedIn) -> Decided:
    """Confirm that the correction is in the offset now. Confirming twice is harmless.

    An `offset_after` that differs from `offset_expected` by more than 0.0005 mm raises the alarm *offset differs*: nothing
    is corrected through this tool until a person has said which offset is true. If it is the offset that earlier or later
    pending corrections of the tool lead to, those are confirmed with this one. A machine that confirms what may not be in
    the offset is refused (409), and its `offset_after` is compared all the same.
    """
    return applying.mark_applied(
        on.session,
        on.machine,
        on.number,
        on.caller,
        offset_after=applied.offset_after,
        applied_at=applied.applied_at,
        mapping=applied.mapping,
    )


def reject_correction(on: OfCorrection, decision: RejectionIn) -> Decided:
    """It will not be applied: the machine refuses the offset, or a person decides against it."""
    return actions.decide(
        on.session,
        on.machine,
        on.number,
        REJECT,
        decision.reason,
        on.caller,
        although_fetched=decision.although_fetched,
    )


def approve_correction(on: OfCorrection, decision: CorrectionDecisionIn) -> Decided:
    """A person approves a correction that awaits it; the machine may apply it then."""
    return actions.decide(on.session, on.machine, on.number, APPROVE, decision.reason, on.caller)


def release_correction(on: OfCorrection, decision: CorrectionDecisionIn) -> Decided:
    """A person releases a held correction; the machine may apply it then. Its alarm stays until it is acknowledged."""
    return actions.decide(on.session, on.machine, on.number, RELEASE, decision.reason, on.caller)


def _decided_so(decision: Decision) -> Any:
    """After a `Conflict`: tells if the caller had decided the same before."""

    def own(on: OfCorrection) -> bool:
        correction = on.row.correction
        return bool(correction.decided_by == on.caller.name and correction.status == decision.into)

    return own


def _to_machine(on: OfCorrection) -> str:
    return _("The machine fetches it and changes the offset of tool {tool} by {amount}.").format(**on.values)


def _rejecting(on: OfCorrection) -> list[str]:
    correction = on.row.correction
    return [
        _("Tool {tool} is not changed by {amount}. The next reading asks again if it is needed.").format(**on.values),
        *filter(None, [wording.counted_on(queries.counting_on(on.session, on.machine, correction))]),
        *([wording.is_out(correction), _("Take the text back first.")] if correction.fetched_at else []),
    ]


def _offset_shown(on: OfCorrection) -> Size:
    row = on.row
    hint = "" if row.expected is None else typed_length(row.expected)
    return Size("offset_after", _("Offset the control shows"), f"R10 = {row.correction.tool_memory}", hint=hint)


CORRECTION: tuple[Verb[OfCorrection, Any], ...] = (
    Verb(
        name=RELEASE.verb,
        when=RELEASE.of,
        role="operator",
        body=CorrectionDecisionIn,
        act=release_correction,
        own=_decided_so(RELEASE),
        word=lambda: _("Release"),
        title=lambda _on: _("Release correction {number}?"),
        follows=lambda on: [
            _to_machine(on),
            _("Its alarm stays active until it is acknowledged; it is better to decide there."),
        ],
        reasons=lambda: [_("Edge looked at, still good"), _("Until the end of the batch"), _("Replaced at next stop")],
        said=lambda: _("Correction {n} is released; it waits for the machine."),
    ),
    Verb(
        name=APPROVE.verb,
        when=APPROVE.of,
        role="operator",
        body=CorrectionDecisionIn,
        act=approve_correction,
        own=_decided_so(APPROVE),
        word=lambda: _("Approve"),
        title=lambda _on: _("Approve correction {number}?"),
        follows=lambda on: [_to_machine(on)],
        reasons=lambda: [_("As expected"), _("Part measured, agrees"), _("Process is known")],
        likely=lambda: _("As expected"),
        said=lambda: _("Correction {n} is approved; it waits for the machine."),
    ),
    Verb(
        name="applied",
        when=("pending",),
        role="operator",
        body=AppliedIn,
        needs_body=False,
        by_machine=True,
        act=mark_applied,
        word=lambda: _("Mark applied"),
        title=lambda _on: _("Is correction {number} in the control?"),
        follows=lambda on: [
            _("The offset of tool {tool} changes by {amount}, to {after}.").format(**on.values),
            _("Enter what the control shows if it shows another offset."),
        ],
        size=_offset_shown,
        said=lambda: _("Correction {n} is applied."),
    ),
    Verb(
        name=REJECT.verb,
        when=REJECT.of,
        role="operator",
        body=RejectionIn,
        act=reject_correction,
        by_machine=True,
        own=_decided_so(REJECT),
        asks_again=lambda error: "fetched_at" in error.more,
        word=lambda: _("Reject"),
        title=lambda _on: _("Reject correction {number}?"),
        follows=_rejecting,
        reasons=lambda: [_("False reading"), _("Not applied at the machine"), _("Set by hand instead")],
        hidden=lambda on: {"although_fetched": "true"} if on.row.correction.fetched_at else {},
        said=lambda: _("Correction {n} is rejected."),
    ),
)


def offered(status: str) -> list[Verb[OfCorrection, Any]]:
    """Acts that a correction of this status permits to a person of their role, the likeliest first."""
    return [verb for verb in CORRECTION if status in verb.when]


# --- tools and averages


def _falling(on: OfTool) -> list[str]:
    opened = on.row.open
    return [
        _("The running averages of the characteristics on it begin at 0."),
        *([wording.will_fall([correction.number for correction in opened])] if opened else []),
    ]


def _edit(on: OfTool, edit: ToolEdit) -> Said:
    before = on.row.tool.offset
    actions.edit_tool(on.session, on.machine, on.number, edit.offset, edit.reason, on.caller)
    return Said(_far(before, edit.offset) or "edit", on.number)


def _change(on: OfTool, change: ToolChange) -> Said:
    before = on.row.tool.offset
    actions.change_tool(on.session, on.machine, on.number, change.offset, change.reason, on.caller)
    return Said(_far(before, change.offset) or "change", on.number)


def _far(before: float, after: float) -> str | None:
    """The message where an offset that was set may be in another unit."""
    codes = ({"offset_step": "edit-far"}.get(warning.code, "edit-inches") for warning in offset_warnings(before, after))
    return next(codes, None)


def _switch(on: OfTool, why: SisterIn) -> Said:
    done = sister_actions.switch_to_sister(on.session, on.machine, on.number, why.reason, on.caller)
    return Said("sister", done.sister)


def _cut(on: OfTool) -> str:
    return ngettext(
        "The old tool cut {parts} part. Parts and sum of corrections begin at 0.",
        "The old tool cut {parts} parts. Parts and sum of corrections begin at 0.",
        on.row.parts,
    ).format(**on.values)


def _switching(on: OfTool) -> list[str]:
    values = {**on.values, "characteristics": ", ".join(on.row.characteristics)}
    return [
        _("From now on {characteristics} correct tool {sister}; each gets a new version of its parameters.").format(
            **values
        ),
        *_falling(on),
        _("Select tool {sister} at the machine before the next part.").format(**values),
    ]


def _offset_of(label: Callable[[], str], value: Callable[[OfTool], str]) -> Callable[[OfTool], Size]:
    return lambda on: Size("offset", label(), f"R10 = {on.number}", value(on), needed=True)


CHANGE: Verb[OfTool, ToolChange] = Verb(
    name="change",
    body=ToolChange,
    act=_change,
    word=lambda: _("Tool changed"),
    title=lambda _on: _("Was tool {tool} changed?"),
    follows=lambda on: [_cut(on), *_falling(on)],
    reasons=lambda: [_("Insert indexed"), _("New insert"), _("New tool"), _("Insert chipped")],
    size=_offset_of(lambda: _("Offset of the new tool"), lambda _on: "0.0000"),
    said=lambda: _("Tool {n} starts a new life."),
)
TOOL: tuple[Verb[OfTool, Any], ...] = (
    CHANGE,
    Verb(
        name="edit",
        body=ToolEdit,
        act=_edit,
        word=lambda: _("Set the offset"),
        title=lambda _on: _("Set the offset of tool {tool} by hand"),
        follows=lambda on: [_("Offset on record: {offset}.").format(**on.values), *_falling(on)],
        reasons=lambda: [_("Set at the control"), _("Part measured by hand"), _("Typing error corrected")],
        size=_offset_of(lambda: _("Offset"), lambda on: typed_length(on.row.tool.offset)),
        said=lambda: _("The offset of tool {n} is set."),
    ),
    Verb(
        name="sister",
        body=SisterIn,
        act=_switch,
        fits=lambda on: on.row.tool.sister is not None and bool(on.row.characteristics),
        word=lambda: _("Switch"),
        title=lambda _on: _("Switch from tool {tool} to its sister {sister}?"),
        follows=_switching,
        reasons=lambda: [_("Edge worn"), _("Insert chipped"), _("Planned life reached")],
        said=lambda: _("Tool {n} takes over as the sister tool. Select it at the machine."),
    ),
)


def _computed_with_it(on: OfAverage) -> list[str]:
    opened = open_corrections(on.session, on.machine, average_memory=on.number)
    return [wording.will_fall_with_it([correction.number for correction in opened])] if opened else []


def _set_empirical_value(on: OfAverage, value: EmpiricalValueIn) -> Said:
    warnings = actions.set_empirical_value(
        on.session, on.machine, on.number, value.empirical_value, value.reason, on.caller
    )
    return Said(warnings[0].code.replace("empirical_value", "average") if warnings else "average", on.number)


AVERAGE: tuple[Verb[OfAverage, Any], ...] = (
    Verb(
        name="edit",
        body=EmpiricalValueIn,
        act=_set_empirical_value,
        word=lambda: _("Set the empirical value"),
        title=lambda _on: _("Set the empirical value of R11 = {location}"),
        follows=lambda on: [
            _("It is taken off every measurement: machine reading minus true value."),
            _("The running average {average} begins at 0.").format(**on.values),
            *_computed_with_it(on),
        ],
        reasons=lambda: [
            _("Compared with the measuring machine"),
            _("Compared with a gauge"),
            _("Probe calibrated"),
        ],
        size=lambda on: Size(
            "empirical_value",
            _("Empirical value"),
            f"R11 = {on.number}",
            typed_length(on.row.memory.empirical_value),
            needed=True,
        ),
        said=lambda: _("The empirical value of R11 = {n} is set."),
    ),
)


def too_late(session: Session, machine: Machine, name: str, number: int) -> list[str]:
    """The page's message where someone else was first: how the correction is now, and what to do instead. Raises `NotFound`."""
    return list(wording.refused(queries.correction(session, machine, number), machine.key, name))


def done(code: str, number: int) -> str | None:
    """The page's message after an act; None for an unknown one."""
    more = {
        "edit-far": _(
            "The offset of tool {n} is set, more than 10 mm from the one before. Offsets are typed in mm: is it µm?"
        ),
        "edit-inches": _(
            "The offset of tool {n} is set; it looks like the one before in inches. Offsets are typed in mm."
        ),
        "described": _("The data of tool {n} is saved."),
        "average": AVERAGE[0].said(),
        "average-large": _(
            "The empirical value of R11 = {n} is set to more than 1 mm: no probe measures so far off. Is it µm?"
        ),
        "average-step": _(
            "The empirical value of R11 = {n} is set. It differs from the previous one by more than the whole tolerance, and the next "
            "correction will include the difference. Was it entered in µm?"
        ),
    }
    return said((*CORRECTION, *TOOL), code, number, more)
