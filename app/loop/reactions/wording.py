"""Reaction plans in words."""

from app.core.spc.rules import RuleName
from app.language.i18n import _
from app.loop.alarms.kinds import kind_named
from app.loop.summaries.wording import rule_name
from app.loop.tables.reactions import ReactionPlan

MINUTE, HOUR, DAY = 60, 3600, 86400


def duration(seconds: float | None) -> str:
    """A time that people react in: `45 s`, `12 min`, `3.5 h`, `2.0 d`; a dash where it is not known."""
    if seconds is None:
        return "–"
    if seconds < MINUTE:
        return _("{n} s").format(n=round(seconds))
    if seconds < HOUR:
        return _("{n} min").format(n=round(seconds / MINUTE))
    if seconds < DAY:
        return _("{n} h").format(n=f"{seconds / HOUR:.1f}")
    return _("{n} d").format(n=f"{seconds / DAY:.1f}")


def scope_words(plan: ReactionPlan) -> str:
    """The alarms that a plan is for."""
    what = _("every alarm")
    if plan.rule is not None:
        what = rule_name(RuleName(plan.rule))
    elif plan.kind is not None:
        what = kind_named(plan.kind).word()
    return what if plan.characteristic is None else _("{what} at {where}").format(what=what, where=plan.characteristic)
