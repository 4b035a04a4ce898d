"""AQDEF files on the command line: `inband import FILE.dfq` and `inband export --format dfq`."""

import getpass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

import typer

from app.cli.base import say
from app.cli.stored import stored_before, stored_of, which
from app.language.i18n import _, ngettext
from app.language.times import MINUTES, written

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from app.core.period import Period
    from app.db.engine import Database
    from app.loop.readings.aqdef.actions import Outcome, Result
    from app.loop.readings.aqdef.matching import Content
    from app.loop.readings.aqdef.sorting import Wishes


def is_aqdef(file: Path) -> bool:
    """Tell by its name."""
    from app.files.aqdef.description import ENDINGS

    return file.suffix.lower() in ENDINGS


def wishes_for(zone: ZoneInfo, unit: str | None, encoding: str | None, *, day_first: bool | None) -> "Wishes":
    """The choices that options say."""
    from app.files.aqdef.times import day_order
    from app.loop.readings.aqdef.sorting import Wishes

    return Wishes(zone, day_order(day_first), unit, encoding)


def import_file(
    database: "Database",
    file: Path,
    wishes: "Wishes",
    *,
    mapping: str,
    characteristic: str,
    create_missing: bool,
    machine: str | None,
    dry_run: bool,
    progress: Any,
) -> "Outcome":
    """Import a file and say what it came to. Raises `Flawed`, and `typer.BadParameter` for what cannot be chosen."""
    from app.files.aqdef.description import Source
    from app.files.formats.delimited import Unusable
    from app.loop.readings.aqdef import actions, matching

    try:
        source = Source.at(file, wishes.encoding)
    except Unusable as error:
        raise typer.BadParameter(str(error), param_hint="FILE") from None
    description = actions.describe(source)
    found = matching.contents(description, wishes.unit)
    with database.begin() as session:
        chosen = actions.guess(session, found)
        on = actions.machine_for(session, found, machine)
    chosen |= _said(mapping, characteristic, found)
    if create_missing:
        chosen = actions.with_missing(chosen, found)
    _tell(found, chosen, description.encoding)
    outcome = actions.import_aqdef(
        database,
        source,
        description,
        chosen,
        wishes,
        machine=on,
        actor=f"command line ({getpass.getuser()})",
        name=file.name,
        dry_run=dry_run,
        progress=progress,
    )
    _sum_up(outcome, found, dry_run=dry_run)
    return outcome


def _said(mapping: str, characteristic: str, found: "list[Content]") -> dict[int, str]:
    from app.loop.readings.aqdef import matching

    if characteristic:
        lengths = [each for each in found if not each.obstacle]
        if len(lengths) != 1:
            reason = _("The file has {count} characteristics of lengths: say which is which with --map.")
            raise typer.BadParameter(reason.format(count=len(lengths)), param_hint="--characteristic")
        return {lengths[0].index: characteristic}
    try:
        return matching.said(mapping, found)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--map") from None


def _tell(found: "list[Content]", chosen: dict[int, str], encoding: str) -> None:
    """Print how the file is understood."""
    from app.loop.readings.aqdef.matching import NEW

    text = ngettext(
        "%(num)d characteristic, %(encoding)s text.", "%(num)d characteristics, %(encoding)s text.", len(found)
    )
    say(text % {"num": len(found), "encoding": encoding.removesuffix("-sig")})
    for each in found:
        key = chosen.get(each.index)
        if each.obstacle:
            say(_("{title}: left out: {reason}.").format(title=each.title, reason=each.obstacle), style="yellow")
            continue
        if not key:
            reason = each.not_new or _("nothing of its part here has its number or name; --map or --create-missing")
            reason = reason if key is None else _("--map says so")
            say(_("{title}: left out: {reason}.").format(title=each.title, reason=reason), style="yellow")
            continue
        say(f"{each.title} → {key}" if key != NEW else each.title + " → " + _("to be set up"))
        for remark in each.remarks:
            say(f"  {remark}")


def _sum_up(outcome: "Outcome", found: "list[Content]", *, dry_run: bool) -> None:
    from app.loop.readings.aqdef.matching import leaving_out

    for each in sorted(outcome.results, key=lambda each: each.trouble is None):  # the reason of a refusal first
        _result(each, dry_run=dry_run)
    if bad := outcome.refused:
        say(_("To import the others: --map '{argument}'").format(argument=leaving_out(bad, found)), style="bold red")
    for remark in outcome.remarks:
        say(remark, style="yellow")
    if not any(each.trouble for each in outcome.results):
        say(_("They are history: no correction, no alarm, and the running average stays as it was."))


def _result(result: "Result", *, dry_run: bool) -> None:
    for doubt in result.doubts:
        say(f"{result.key}: {doubt}", style="yellow")
    if result.trouble is not None:
        say(f"{result.key}: {result.trouble.detail} {result.trouble.what_to_do or ''}", style="bold red")
        return
    if result.created:
        text = _("{key} is set up with the drawing's limits; it measures only. Check its zones before it corrects.")
        say(text.format(key=result.key))
    summary = result.summary
    assert summary is not None
    begin = _("Nothing was stored; this would be: ") if dry_run else ""
    text = stored_of(summary.stored, result.key)
    if summary.stored and summary.first_at is not None and summary.last_at is not None:
        text += _(", measured {span}").format(
            span=f"{written(summary.first_at, MINUTES)} – {written(summary.last_at, MINUTES)}"
        )
    say(f"{begin}{text}.", style="bold")
    if summary.repeated:
        say(stored_before(summary.repeated))
    if result.excluded:
        text = ngettext(
            "%(num)d is excluded, as the file marks it (K0002).",
            "%(num)d are excluded, as the file marks them (K0002).",
            result.excluded,
        )
        say(text % {"num": result.excluded})


def export_file(
    session: "Session",
    keys: list[str],
    output: Path,
    *,
    period: "Period",
    last: int | None,
) -> None:
    """Write readings of these characteristics, and say what was made to fit."""
    from app.access.audit import actions as audit
    from app.loop.readings.aqdef.export import write_aqdef
    from app.loop.readings.exporting import Ends

    ends: dict[str, Ends] = {}
    done = write_aqdef(session, keys, output, period=period, last=last, ends=ends)
    for key in dict.fromkeys(keys):
        audit.record(
            session,
            f"command line ({getpass.getuser()})",
            "readings exported",
            f"characteristic/{key}",
            after={"file": output.name, "format": "dfq"},
        )
    for remark in done.remarks:
        say(remark, style="yellow")
    text = ngettext("%(num)d reading written to AQDEF", "%(num)d readings written to AQDEF", done.values)
    of = {key: which(each.numbers, each.span) for key, each in ends.items()}
    say(f"{text % {'num': done.values}}{next(iter(of.values())) if len(of) == 1 else ''}.")
    none = _(", no readings")
    for key, words in of.items() if len(of) > 1 else ():
        say(f"{key}{words or none}.")
