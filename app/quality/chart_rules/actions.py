"""Switching rules on and off. A change makes a new version; what older rules have found stays."""

from collections.abc import Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.spc.rules import RuleName
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.tables.characteristics import Characteristic
from app.quality.baselines.queries import baseline_in_force
from app.quality.chart_rules import wording
from app.quality.chart_rules.places import Do, Place, Rules, Setting, Watched, rules_at, stored_rules
from app.quality.chart_rules.queries import rules_in_force
from app.quality.chart_rules.tables import RuleSet

Wanted = Mapping[Place, Mapping[RuleName, Do]]


def set_rules(
    session: Session,
    current: CurrentCharacteristic,
    wanted: Wanted,
    reason: str,
    caller: Caller,
    *,
    look_back: bool = False,
    seen: int | None = None,
) -> Watched:
    """These rules watch from the next reading on, and no others.

    look_back: the readings since the period of the baseline are judged too; they raise no alarm. seen: the version that
    was changed. Raises `Invalid` for a rule that has no sense on its chart; `Conflict` if someone else was faster.
    """
    characteristic = current.characteristic
    session.execute(  # versions count without gaps: of two who change the rules at once, one waits
        select(Characteristic.id)
        .where(Characteristic.machine_id == current.machine.id, Characteristic.id == characteristic.id)
        .with_for_update(key_share=True)
    )
    before = rules_in_force(session, characteristic)
    if seen is not None and seen != before.version:
        raise Conflict(
            _("Another person has changed the rules meanwhile: version {version} is in force.").format(
                version=before.version
            ),
            _("Load the page again and look what they are now."),
        )
    baseline = baseline_in_force(session, characteristic)
    _check(wanted, {place: rules_at(baseline, place) for place in Place}, strict=baseline is not None)
    newest = statistics.window_of(session, characteristic).newest
    back = baseline.version if look_back and baseline is not None else None
    rules: Rules = {}
    for place, named in wanted.items():
        for name, do in named.items():
            old = before.rules.get(place, {}).get(name)
            since = newest if old is None else old.since
            rules.setdefault(place, {})[name] = Setting(do, since, back or (old.back if old is not None else None))
    if rules == before.rules:
        return before
    session.add(
        RuleSet(
            machine_id=current.machine.id,
            characteristic_id=characteristic.id,
            version=before.version + 1,
            rules=stored_rules(rules),
            actor=caller.name,
            reason=reason,
        )
    )
    record(
        session,
        caller.name,
        "rules changed",
        f"characteristic/{characteristic.key}",
        wording.as_recorded(before.rules),
        wording.as_recorded(rules),
        reason,
    )
    publish(session, {"kind": "rules", "machine": current.machine.key, "characteristic": characteristic.key})
    return rules_in_force(session, characteristic)


def _check(wanted: Wanted, fitting: Mapping[Place, tuple[RuleName, ...]], *, strict: bool) -> None:
    """Without a baseline it is not known which charts there will be: then only what never has a sense is refused."""
    wrong = [
        FieldError(
            f"rules.{place.value}.{name.value}",
            _("has no sense on this chart: {why}").format(why=wording.why_not(place)),
        )
        for place, rules in wanted.items()
        for name in rules
        if name not in fitting[place] and (strict or place is not Place.MAIN)
    ]
    if wrong:
        raise Invalid.of(wrong, _("Leave these rules off. Nothing was changed."))
