"""Freezing a baseline, retiring it, and putting an older one in force again."""

from sqlalchemy import func, inspect, select
from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.tables.characteristics import Characteristic
from app.quality.baselines import queries, wording
from app.quality.baselines.draft_queries import draft_of
from app.quality.baselines.given_limits import limits_of
from app.quality.baselines.schemas import BaselineIn, PeriodIn
from app.quality.baselines.tables import Baseline
from app.web.created import Created

OF_ITS_TIME = frozenset(
    {"version", "key", "repeats", "at", "actor", "reason", "retired_at", "retired_by", "retired_why"}
)


def freeze(session: Session, current: CurrentCharacteristic, given: BaselineIn, caller: Caller) -> Created[Baseline]:
    """From now on readings are judged by this period. Raises `Invalid`; `Conflict`: another was meanwhile, or by this key."""
    _lock(session, current)
    if given.key is not None:
        before = session.scalars(
            select(Baseline).where(
                Baseline.machine_id == current.machine.id,
                Baseline.characteristic_id == current.characteristic.id,
                Baseline.key == given.key,
            )
        ).one_or_none()
        if before is not None:
            return _sent_before(before, given)
    newest = queries.newest_version(session, current.characteristic)
    if given.seen_version is not None and given.seen_version != newest:
        raise Conflict(
            _("Another person has frozen baseline {version} meanwhile.").format(version=newest),
            _("Look at it; freeze yours if it is still to take its place."),
        )
    baseline = draft_of(session, current, given).baseline
    baseline.key, baseline.reason = given.key, given.reason
    return Created(_keep(session, current, baseline, caller))


def _sent_before(before: Baseline, given: BaselineIn) -> Created[Baseline]:
    limits = limits_of(given)
    frozen = (before.centre, before.sigma) if before.given else None
    same = frozen == (limits and (limits.centre, limits.sigma.value)) and all(
        getattr(before, name) == value
        for name, value in given.model_dump(mode="json", include=set(PeriodIn.model_fields) - {"limits"}).items()
        if not (name == "settle" and value is None)  # what was left out was found in the readings
    )
    if not same:
        raise Conflict(
            _("Baseline {version} was frozen with the key {key}, otherwise than it is sent now.").format(
                version=before.version, key=repr(before.key)
            ),
            _("Send another key for another baseline."),
        )
    return Created(before, again=True)


def put_in_force(
    session: Session, current: CurrentCharacteristic, version: int, reason: str, caller: Caller
) -> Baseline:
    """An older baseline judges again: its numbers as a new version. Raises `NotFound`; `Conflict` if it is in force."""
    _lock(session, current)
    old = queries.baseline_of(session, current.characteristic, version)
    now = queries.baseline_in_force(session, current.characteristic)
    if now is not None and version in {now.version, now.repeats}:  # sent twice, or by two at once
        raise Conflict(
            _("Baseline {version} is in force already.").format(version=version)
            if now.version == version
            else _("Baseline {version} is in force already: its numbers are those of version {now}.").format(
                version=version, now=now.version
            ),
            _("Choose another version, or freeze a new one."),
        )
    names = {column.key for column in inspect(Baseline).column_attrs} - OF_ITS_TIME
    again = Baseline(**{name: getattr(old, name) for name in names}, repeats=version, reason=reason)
    return _keep(session, current, again, caller)


def retire(session: Session, current: CurrentCharacteristic, version: int, reason: str, caller: Caller) -> Baseline:
    """It judges no more, and none judges in its place. Raises `NotFound`; `Conflict` if it is not in force."""
    _lock(session, current)
    baseline = queries.baseline_of(session, current.characteristic, version)
    now = queries.baseline_in_force(session, current.characteristic)
    if now is None or now.version != version:
        raise Conflict(
            _("Baseline {version} is not in force.").format(version=version),
            _("Only the newest one is, unless it was retired; older versions judge nothing any more."),
        )
    baseline.retired_at = session.scalars(select(func.now())).one()
    baseline.retired_by, baseline.retired_why = caller.name, reason
    _tell(session, current, "baseline retired", baseline, caller, reason, before=_recorded(baseline))
    return baseline


def _lock(session: Session, current: CurrentCharacteristic) -> None:
    """Versions count without gaps: of two who freeze at once, one waits. Readings are not decided by baselines and go on."""
    session.execute(
        select(Characteristic.id)
        .where(Characteristic.machine_id == current.machine.id, Characteristic.id == current.characteristic.id)
        .with_for_update(key_share=True)
    )


def _keep(session: Session, current: CurrentCharacteristic, baseline: Baseline, caller: Caller) -> Baseline:
    before = queries.baseline_in_force(session, current.characteristic)
    baseline.version = 1 + queries.newest_version(session, current.characteristic)
    baseline.actor = caller.name
    session.add(baseline)
    session.flush()
    session.refresh(baseline)
    action = "baseline frozen" if baseline.repeats is None else "baseline put in force again"
    _tell(
        session,
        current,
        action,
        baseline,
        caller,
        baseline.reason,
        before=None if before is None else _recorded(before),
        after=_recorded(baseline),
    )
    return baseline


def _recorded(baseline: Baseline) -> dict[str, object]:
    return {
        "version": baseline.version,
        "chart": baseline.chart,
        "quantity": baseline.quantity,
        "period": wording.period(baseline),
        "centre": baseline.centre,
        "sigma": baseline.sigma,
    }


def _tell(
    session: Session,
    current: CurrentCharacteristic,
    action: str,
    baseline: Baseline,
    caller: Caller,
    why: str,
    *,
    before: dict[str, object] | None = None,
    after: dict[str, object] | None = None,
) -> None:
    key = current.characteristic.key
    audit(session, caller.name, action, f"characteristic/{key}", before, after, why)
    publish(
        session,
        {
            "kind": "baseline",
            "machine": current.machine.key,
            "characteristic": key,
            "version": baseline.version,
            "in_force": baseline.retired_at is None,
        },
    )
