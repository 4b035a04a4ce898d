"""Confirmation dialogs before an action on a correction, a tool or an average: title, consequences, the reasons to choose
from, and the one number that may be typed.
"""

from dataclasses import dataclass, field
from typing import cast

from app.errors import NotFound
from app.language.i18n import _, ngettext
from app.language.numbers import mm, typed_length, um
from app.loop.tables.tools import Tool
from app.loop.tools import wording
from app.loop.tools.actions import Verb
from app.loop.tools.queries import AverageRow, CorrectionRow, ToolRow


@dataclass(frozen=True)
class Question:
    """Content of a confirmation dialog. ``number``: field for a length (mm), if there is one; ``hidden``: hidden fields."""

    title: str
    button: str
    send_to: str
    follows: list[str]
    reasons: list[str] = field(default_factory=list)
    number: str | None = None
    number_label: str = ""
    number_r: str | None = None
    number_value: str = ""
    number_hint: str = ""
    number_needed: bool = False
    hidden: dict[str, str] = field(default_factory=dict)


def offered(status: str) -> list[str]:
    """Actions that a person may take on a correction of this status, the likeliest first."""
    return {
        "held": ["release", "rejected"],
        "awaiting_approval": ["approve", "rejected"],
        "pending": ["applied", "rejected"],
    }.get(status, [])


def verb(word: str) -> Verb:
    """The action on a correction that a form names. Raises `NotFound` for an unknown one."""
    if word in {"approve", "release", "rejected"}:
        return cast("Verb", word)
    raise NotFound(_("The form does not say what to do with the correction."), _("Go back to the tool memory."))


def about_correction(row: CorrectionRow, verb: str, counting_on: list[int], came_from: str | None = None) -> Question:
    """The dialog to approve, release or reject a correction, or to mark it applied. counting_on: see the query of that name."""
    c = row.correction
    hidden = {"do": verb} | ({"from": came_from} if came_from else {})
    values = {"number": c.number, "amount": um(c.amount), "tool": c.tool_memory, "machine": row.machine}
    after = "–" if row.expected is None else mm(row.expected)
    send_to = f"/machines/{row.machine}/corrections/{c.number}"
    to_machine = _("The machine fetches it and changes the offset of tool {tool} by {amount}.").format(**values)
    match verb:
        case "applied":
            return Question(
                _("Is correction {number} in the control?").format(**values),
                _("It is applied"),
                send_to,
                [
                    _("The offset of tool {tool} changes by {amount}, to {after}.").format(**values, after=after),
                    _("Say what the control shows if it shows another offset."),
                ],
                hidden=hidden,
                number="offset_after",
                number_label=_("Offset the control shows"),
                number_r=f"R10 = {c.tool_memory}",
                number_hint="" if row.expected is None else typed_length(row.expected),
            )
        case "approve":
            return Question(
                _("Approve correction {number}?").format(**values),
                _("Approve"),
                send_to,
                [to_machine],
                [_("Part measured, agrees"), _("Process is known"), _("As expected")],
                hidden=hidden,
            )
        case "release":
            return Question(
                _("Release correction {number}?").format(**values),
                _("Release"),
                send_to,
                [to_machine, _("Its alarm stays until it is acknowledged; better decide there.")],
                [_("Edge looked at, still good"), _("Until the end of the batch"), _("Replaced at next stop")],
                hidden=hidden,
            )
        case _:
            return Question(
                _("Reject correction {number}?").format(**values),
                _("Reject"),
                send_to,
                [
                    _("Tool {tool} is not changed by {amount}. The next reading asks again if it is needed.").format(
                        **values
                    ),
                    *filter(None, [wording.counted_on(counting_on)]),
                    *([wording.is_out(c), _("Take the text back first.")] if c.fetched_at else []),
                ],
                [_("False reading"), _("Not applied at the machine"), _("Set by hand instead")],
                hidden=hidden | ({"although_fetched": "true"} if c.fetched_at else {}),
            )


def about_all(machine: str, tool: Tool, numbers: list[int], total: float, after: float) -> Question:
    """The dialog to approve all corrections of one tool together."""
    return Question(
        ngettext(
            "Approve {n} correction of tool {tool}?", "Approve {n} corrections of tool {tool}?", len(numbers)
        ).format(n=len(numbers), tool=tool.number),
        _("Approve all"),
        f"/corrections/{machine}/tools/{tool.number}",
        [
            ngettext("Correction {numbers}: {total}.", "Corrections {numbers}: {total} in all.", len(numbers)).format(
                numbers=", ".join(map(str, numbers)), total=um(total)
            ),
            _("The machine fetches them; the offset of tool {tool} goes from {offset} to {after}.").format(
                tool=tool.number, offset=mm(tool.offset), after=mm(after)
            ),
        ],
        [_("Part measured, agrees"), _("Process is known"), _("As expected")],
        hidden={"numbers": " ".join(map(str, numbers))},
    )


def about_tool(row: ToolRow, machine: str, what: str) -> Question:
    """The dialog to set an offset by hand, or to report a tool change. Raises `NotFound` for anything else."""
    number = row.tool.number
    values = {"tool": number, "offset": mm(row.tool.offset), "parts": row.parts}
    follows = [_("The running averages of the characteristics on it begin at 0.")]
    if row.open:
        follows.append(wording.will_fall([c.number for c in row.open]))
    match what:
        case "edit":
            return Question(
                _("Set the offset of tool {tool} by hand").format(**values),
                _("Set the offset"),
                f"/machines/{machine}/tools/{number}/edit",
                [_("Known until now: {offset}.").format(**values), *follows],
                [_("Set at the control"), _("Part measured by hand"), _("Typing error corrected")],
                number="offset",
                number_label=_("Offset"),
                number_r=f"R10 = {number}",
                number_value=typed_length(row.tool.offset),
                number_needed=True,
            )
        case "change":
            return Question(
                _("Tool {tool} was changed?").format(**values),
                _("Tool changed"),
                f"/machines/{machine}/tools/{number}/change",
                [
                    ngettext(
                        "The old tool cut {parts} part. Parts and sum of corrections begin at 0.",
                        "The old tool cut {parts} parts. Parts and sum of corrections begin at 0.",
                        row.parts,
                    ).format(**values),
                    *follows,
                ],
                [_("Insert turned"), _("New insert"), _("New tool"), _("Insert chipped")],
                number="offset",
                number_label=_("Offset of the new tool"),
                number_r=f"R10 = {number}",
                number_value="0.0000",
                number_needed=True,
            )
        case "sister" if row.tool.sister is not None and row.characteristics:
            values["sister"] = row.tool.sister
            follows = [
                _(
                    "{characteristics} correct tool {sister} from now on: a new version of the parameters of each."
                ).format(characteristics=", ".join(row.characteristics), **values),
                *follows,
                _("Select tool {sister} at the machine before the next part.").format(**values),
            ]
            return Question(
                _("Switch from tool {tool} to its sister {sister}?").format(**values),
                _("Switch"),
                f"/machines/{machine}/tools/{number}/sister",
                follows,
                [_("Edge worn"), _("Insert chipped"), _("Planned life reached")],
            )
        case _:
            raise NotFound(_("There is nothing at this address."), _("Go back to the tool memory."))


def about_average(row: AverageRow, machine: str) -> Question:
    """The dialog to set an empirical value."""
    memory = row.memory
    return Question(
        _("Set the empirical value of R11 = {location}").format(location=memory.location),
        _("Set the empirical value"),
        f"/machines/{machine}/averages/{memory.location}/edit",
        [
            _("It is taken off every measurement: machine reading minus true value."),
            _("The running average {average} begins at 0.").format(average=um(memory.average)),
        ],
        [_("Compared with the measuring machine"), _("Compared with a gauge"), _("Probe calibrated")],
        number="empirical_value",
        number_label=_("Empirical value"),
        number_r=f"R11 = {memory.location}",
        number_value=typed_length(memory.empirical_value),
        number_needed=True,
    )


def done(verb: str, number: int) -> str | None:
    """The page's message after the action."""
    sentence = {
        "applied": _("Correction {n} is applied."),
        "approve": _("Correction {n} is approved; it waits for the machine."),
        "release": _("Correction {n} is released; it waits for the machine."),
        "approve-all": _("All that awaited approval for tool {n} is approved; it waits for the machine."),
        "rejected": _("Correction {n} is rejected."),
        "edit": _("The offset of tool {n} is set."),
        "edit-far": _(
            "The offset of tool {n} is set, more than 10 mm from the one before. Offsets are typed in mm: is it µm?"
        ),
        "edit-inches": _(
            "The offset of tool {n} is set; it looks like the one before in inches. Offsets are typed in mm."
        ),
        "change": _("Tool {n} starts a new life."),
        "sister": _("Tool {n} goes on as the sister tool. Select it at the machine."),
        "described": _("The data of tool {n} is saved."),
        "average": _("The empirical value of R11 = {n} is set."),
        "average-large": _(
            "The empirical value of R11 = {n} is set to more than 1 mm: no probe measures so far off. Is it µm?"
        ),
    }.get(verb)
    return None if sentence is None else sentence.format(n=number)
