"""Consequences of an acknowledgement, in sentences."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from app.language.formatting import mm, read_um
from app.language.i18n import _, ngettext
from app.loop.alarms.kinds import kinds

MOST_NUMBERS = 5  # in one sentence


def numbers(values: Sequence[int]) -> str:
    """Numbers in a sentence, not more than one reads: `4, 5, 6 … 812`."""
    if len(values) <= MOST_NUMBERS:
        return ", ".join(map(str, values))
    return f"{', '.join(map(str, values[: MOST_NUMBERS - 1]))} … {values[-1]}"


def outcomes(outcome: Sequence[dict[str, Any]] | None, half: float | None = None) -> list[dict[str, Any]]:
    """The consequences, each with its sentence. half: as of `deserved`, mm."""
    if outcome is None:
        return []
    if not outcome:
        return [{"code": "nothing_else", "text": _("Nothing else was changed.")}]
    return [{**item, "text": _followed(item, half)} for item in outcome]


def found_by_hand(measured: float | None, good: bool | None) -> str:
    """The text of a manual measurement: `40.0010 mm, part is good`."""
    verdict = [] if good is None else [_("the part is good")] if good else [_("the part is scrap")]
    return ", ".join([*([mm(measured)] if measured is not None else []), *verdict])


_SENTENCES: Mapping[str, Callable[[int], str]] = {
    "tool_restarted": lambda n: ngettext(
        "Tool {tool} starts a new life with offset {offset}; the old one cut {parts} part.",
        "Tool {tool} starts a new life with offset {offset}; the old one cut {parts} parts.",
        n,
    ),
    "offset_assumed": lambda _n: _("No offset was entered; {offset} is assumed."),
    "offset_far": lambda _n: _("It was {before}, and is {offset} now. Offsets are typed in mm: is it µm, or inches?"),
    "tool_changed_already": lambda _n: _("Tool {tool} had been changed since, so nothing was restarted a second time."),
    "corrections_superseded": lambda n: ngettext(
        "Correction {numbers} was dropped.", "Corrections {numbers} were dropped.", n
    ),
    "averages_restarted": lambda n: ngettext(
        "The running average R11 = {locations} begins at 0.",
        "The running averages R11 = {locations} begin at 0.",
        n,
    ),
    "correction_released": lambda _n: _("Correction {number} of {amount} was released to the machine."),
    "measured_by_hand": lambda _n: _("Reading {sequence} was measured by hand: {found}."),
    "nothing_held": lambda _n: _("No correction was held any more."),
    "still_held": lambda _n: _("Correction {number} is still held."),
    "readings_excluded": lambda n: ngettext(
        "Reading {sequences} of {characteristic} was excluded.",
        "Readings {sequences} of {characteristic} were excluded.",
        n,
    ),
    "readings_excluded_before": lambda n: ngettext(
        "Reading {sequences} of {characteristic} had been excluded before.",
        "Readings {sequences} of {characteristic} had been excluded before.",
        n,
    ),
    "correction_withdrawn": lambda _n: _("Correction {number} of {amount} was withdrawn."),
    "correction_applied": lambda _n: _(
        "Correction {number} of {amount} is in the offset already; the next readings correct it."
    ),
    "switched": lambda _n: _("Tool {sister} goes on for tool {tool}; corrected by {characteristics}."),
    "switched_already": lambda _n: _(
        "Tool {sister} had taken over from tool {tool} already, so nothing was switched a second time."
    ),
    "offset_set": lambda _n: _("The offset of tool {tool} is {offset}."),
    "offset_told_already": lambda _n: _("The offset of tool {tool} had been set by hand since, to {offset}."),
    "level_followed": lambda _n: _("The next readings are expected where the jump has led."),
    "level_disagrees": lambda _n: _(
        "Readings since then lie where they were expected before the jump, so nothing of it is corrected."
    ),
    "readings_disagree": lambda _n: _(
        "Readings since then lie within the wear limit R37, so nothing of it is corrected."
    ),
    "tool_resumed": lambda _n: _("Compensation through tool {tool} goes on."),
    "resumed": lambda _n: _("Compensation of {characteristic} goes on."),
}
"""By code, from the number of parts, corrections, readings or averages that the sentence is about. A kind of alarm may have others."""


def _followed(item: dict[str, Any], half: float | None) -> str:
    code, listed = item["code"], {name: item.get(name, ()) for name in ("numbers", "sequences", "locations")}
    values = {
        **item,
        **{name: numbers(each) for name, each in listed.items()},
        "offset": mm(item.get("offset")),
        "amount": read_um(item.get("amount"), half),
        "characteristics": ", ".join(item.get("characteristics", ())),
    }
    if code == "offset_far":
        values["before"] = mm(item["before"])
    if code == "measured_by_hand":
        values["found"] = found_by_hand(item.get("measured"), item.get("good"))
    count = item["parts"] if code == "tool_restarted" else max(map(len, listed.values()))
    if code in _SENTENCES:
        return _SENTENCES[code](count).format(**values)
    return next((kind.outcomes[code](item) for kind in kinds() if code in kind.outcomes), str(code))
