"""Consequences of an acknowledgement, in sentences."""

from collections.abc import Sequence
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


def _followed(item: dict[str, Any], half: float | None) -> str:
    values = {
        **item,
        "offset": mm(item.get("offset")),
        "amount": read_um(item.get("amount"), half),
        "numbers": numbers(item.get("numbers", ())),
        "sequences": numbers(item.get("sequences", ())),
        "locations": numbers(item.get("locations", ())),
        "characteristics": ", ".join(item.get("characteristics", ())),
    }
    count = len(item.get("numbers", ())) or len(item.get("sequences", ())) or len(item.get("locations", ()))
    match item["code"]:
        case "tool_restarted":
            text = ngettext(
                "Tool {tool} starts a new life with offset {offset}; the old one cut {parts} part.",
                "Tool {tool} starts a new life with offset {offset}; the old one cut {parts} parts.",
                item["parts"],
            )
        case "offset_assumed":
            text = _("No offset was entered; {offset} is assumed.")
        case "offset_far":
            text = _("It was {before}, and is {offset} now. Offsets are typed in mm: is it µm, or inches?")
            values["before"] = mm(item["before"])
        case "tool_changed_already":
            text = _("Tool {tool} had been changed since, so nothing was restarted a second time.")
        case "corrections_superseded":
            text = ngettext("Correction {numbers} was dropped.", "Corrections {numbers} were dropped.", count)
        case "averages_restarted":
            text = ngettext(
                "The running average R11 = {locations} begins at 0.",
                "The running averages R11 = {locations} begin at 0.",
                count,
            )
        case "correction_released":
            text = _("Correction {number} of {amount} was released to the machine.")
        case "measured_by_hand":
            text = _("Reading {sequence} was measured by hand: {found}.")
            values["found"] = found_by_hand(item.get("measured"), item.get("good"))
        case "nothing_held":
            text = _("No correction was held any more.")
        case "still_held":
            text = _("Correction {number} is still held.")
        case "readings_excluded":
            text = ngettext(
                "Reading {sequences} of {characteristic} was excluded.",
                "Readings {sequences} of {characteristic} were excluded.",
                count,
            )
        case "readings_excluded_before":
            text = ngettext(
                "Reading {sequences} of {characteristic} had been excluded before.",
                "Readings {sequences} of {characteristic} had been excluded before.",
                count,
            )
        case "correction_withdrawn":
            text = _("Correction {number} of {amount} was withdrawn.")
        case "correction_applied":
            text = _("Correction {number} of {amount} is in the offset already; the next readings correct it.")
        case "switched":
            text = _("Tool {sister} goes on for tool {tool}; corrected by {characteristics}.")
        case "switched_already":
            text = _("Tool {sister} had taken over from tool {tool} already, so nothing was switched a second time.")
        case "offset_set":
            text = _("The offset of tool {tool} is {offset}.")
        case "offset_told_already":
            text = _("The offset of tool {tool} had been set by hand since, to {offset}.")
        case "level_followed":
            text = _("The next readings are expected where the jump has led.")
        case "level_disagrees":
            text = _("Readings since then lie where they were expected before the jump, so nothing of it is corrected.")
        case "readings_disagree":
            text = _("Readings since then lie within the wear limit R37, so nothing of it is corrected.")
        case "tool_resumed":
            text = _("Compensation through tool {tool} goes on.")
        case "resumed":
            text = _("Compensation of {characteristic} goes on.")
        case code:
            return next((kind.outcomes[code](item) for kind in kinds() if code in kind.outcomes), str(code))
    return text.format(**values)
