"""Deliveries that are due, and the end of each. Every function is one short transaction; none of them waits for others.

One process plans at a time. A delivery that it has begun is its own until `BUSY` is over; then it counts as lost, and what was
in it is sent again.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime, timedelta
from functools import cache, partial
from typing import Any

from sqlalchemy import delete, func, or_, select, text, update
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.access.queries import WITHOUT_ACCESS
from app.core import notify
from app.core.notify import ENOUGH_FAILURES, NEVER, Notice, Raised, Record, Route, Step, notices, pause_after
from app.db.events import publish
from app.db.tables import Event
from app.language.i18n import _
from app.language.times import end_of_shift, plant_zone
from app.loop.alarm_response.queries import ITS_CHARACTERISTIC, AlarmRow, alarm
from app.loop.alarm_response.reaction_queries import Reactions, plans_in_force, trouble_of
from app.loop.alarms.kinds import kind_named
from app.loop.maintenance.queries import withheld_since
from app.loop.notifications import failing_queries as failing
from app.loop.notifications import message, queries
from app.loop.notifications.calendar_queries import days_off as days_off_of
from app.loop.notifications.group_schemas import group_of
from app.loop.notifications.means import Answer, Job, Message
from app.loop.notifications.picture import of_last_readings
from app.loop.notifications.schemas import HoursIn, Rule, week
from app.loop.notifications.tables import Announced, Delivery, NotificationRoute, Receiver
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.web.states import URGENCY

BUSY = timedelta(minutes=1)
SHOWN_WITHIN = timedelta(seconds=10)
"""In which an open page has to show a message of a browser: then the next one is reached within 30 s of the alarm."""
KEPT = timedelta(days=31)
"""Time that deliveries stay on record, and what was announced."""
CHATTER = timedelta(days=7)
"""As far back as the same alarm is looked for: the longest hold-off."""
HOLD_OFF = timedelta(minutes=5)
"""In which those whom a reaction plan names are not notified of the same trouble again, as a route has it by itself."""
SETTLED, OLDEST_SHIFT = timedelta(minutes=5), timedelta(hours=24)
MOST_ALARMS = 5_000
MOST_AT_ONCE = 16
"""Messages about alarms that are begun in one look; the others are begun in the next one."""
MOST_EVENTS, MOST_CHANGES = 2_000, 2_000
"""Of one message about changes: events looked through, and changes in it, more only if they are of one event."""
_PLANNING = text("SELECT pg_try_advisory_xact_lock(7291, 'delivery'::regclass::oid::int4)")


def plan(session: Session, address: str, days_off: frozenset[date]) -> list[Job]:
    """Begin every delivery that is due: tests, messages about alarms, changes for webhooks.

    address: of this server, for links. days_off: beside those of the plant's calendar. Another process that plans at this moment leaves nothing to do.
    """
    wanted = select(Receiver).where(
        Receiver.deleted_at.is_(None),
        or_(Receiver.person_id.is_(None), Receiver.person_id.not_in(WITHOUT_ACCESS)),
    )
    if not session.scalar(select(wanted.exists())) or not session.scalar(_PLANNING):
        return []
    rows = {row.id: row for row in session.scalars(wanted)}  # after the lock: as the last one who planned has left them
    now: datetime = session.scalars(select(func.clock_timestamp())).one()
    _give_up(session, now)
    free = {number for number, row in rows.items() if row.busy_until is None or row.busy_until <= now}
    jobs = _tests(session, rows, free, address)
    free -= {job.receiver for job in jobs}
    free -= {number for number, row in rows.items() if row.retry_at is not None and row.retry_at > now}
    about_alarms = _about_alarms(session, rows, free, address, days_off, now)
    free -= {job.receiver for job in about_alarms}
    jobs += about_alarms
    about_receivers = _about_receivers(session, rows, free, address, now)
    free -= {job.receiver for job in about_receivers}
    jobs += about_receivers
    jobs += filter(None, (_about_changes(session, rows[number], address) for number in sorted(free)))
    for job in jobs:
        rows[job.receiver].busy_until = now + BUSY
    return [job for job in jobs if not _offered(session, job, rows[job.receiver])]


ShiftReport = Callable[[Session, datetime, str], tuple[str, str] | None]
"""Subject and text about the shift that ends at a moment, with links to this address; None where nothing happened in it."""


def plan_shifts(session: Session, address: str, report: ShiftReport) -> list[Job]:
    """Begin the mails about shifts that have ended: to each person who wants them the oldest that is due, none twice.

    A shift is due once `SETTLED` has gone by, for what comes late; after `OLDEST_SHIFT` it is due no more.
    """
    wants = select(Receiver).where(
        Receiver.deleted_at.is_(None), Receiver.shift_report, Receiver.person_id.not_in(WITHOUT_ACCESS)
    )
    now: datetime = session.scalars(select(func.clock_timestamp())).one()

    def due() -> list[tuple[Receiver, datetime]]:
        session.expire_all()
        rows = session.scalars(wants.order_by(Receiver.id)).all()
        ends = ((row, end_of_shift(max(row.shift_reported or row.created_at, now - OLDEST_SHIFT))) for row in rows)
        return [(row, end) for row, end in ends if end + SETTLED <= now and _may_have(row, now)]

    made = {
        end: report(session, end, address) for end in {end for _row, end in due()}
    }  # alarms do not wait for these words
    if not made or not session.scalar(_PLANNING):
        return []
    jobs: list[Job] = []
    for row, end in due():  # again: another process may have planned meanwhile
        if end not in made or len(jobs) >= MOST_AT_ONCE:
            continue
        words = made[end]
        if words is None:
            row.shift_reported = end
            continue
        jobs.append(_job(session, row, "shift", Message(*words, {"type": "shift"}), shift_end=end))
        row.busy_until = now + BUSY
    return jobs


def _may_have(row: Receiver, now: datetime) -> bool:
    """Tell if a receiver can be tried now, and takes what is not urgent."""
    if any(until is not None and until > now for until in (row.busy_until, row.retry_at)):
        return False
    quiet = week(map(HoursIn.model_validate, row.quiet))
    return notify.Receiver(row.id, quiet, row.away_until).listens(now, now.astimezone(plant_zone()), urgent=False)


def _give_up(session: Session, now: datetime) -> None:
    """Note which deliveries no page has shown in time, and which a server has begun and not ended."""
    offered = select(Delivery).join(Receiver, Receiver.id == Delivery.receiver_id)
    late = Receiver.busy_until < now + BUSY - SHOWN_WITHIN
    for row in session.scalars(offered.where(Delivery.state == "sending", Delivery.words.is_not(None), late)).all():
        end(session, job_of(row), Answer(delivered=False, text=_("No open page of Inband has shown it.")))
    session.execute(
        update(Delivery)
        .where(Delivery.state == "sending", Delivery.asked_at < now - 2 * BUSY)
        .values(state="lost", ended_at=now)
    )


def _offered(session: Session, job: Job, row: Receiver) -> bool:
    """Tell if a delivery is one that pages fetch; then it waits for them, and they hear of it once this is committed."""
    if job.means != "browser":
        return False
    delivery = session.get_one(Delivery, job.delivery)
    delivery.words = message.in_short(job.message)
    publish(session, {"kind": "delivery", "id": job.delivery, "person": row.person_id})
    return True


def job_of(row: Delivery) -> Job:
    """The job of a delivery that pages fetch."""
    return Job(row.id, row.receiver_id, row.about, "browser", "", None, Message(row.subject, ""), tuple(row.alarms))


def _job(
    session: Session, row: Receiver, about: str, made: Message, *, receivers: Sequence[int] = (), **more: Any
) -> Job:
    """Note that a delivery begins. receivers: numbers of those that it reports."""
    alarms = more.get("alarms", ())
    changes = len(made.data.get("changes", ()))
    delivery = Delivery(
        receiver_id=row.id,
        about=about,
        subject=made.subject,
        alarms=list(alarms),
        changes=changes,
        receivers=list(receivers),
        state="sending",
    )
    session.add(delivery)
    session.flush()
    return _begun(row, delivery, made, **more)


def _begun(row: Receiver, delivery: Delivery, made: Message, **more: Any) -> Job:
    made.data["delivery"] = delivery.id
    return Job(delivery.id, row.id, delivery.about, row.means, row.address, row.secret, made, **more)


def _tests(session: Session, rows: dict[int, Receiver], free: set[int], address: str) -> list[Job]:
    waiting = session.scalars(
        select(Delivery).where(Delivery.state == "waiting", Delivery.receiver_id.in_(free)).order_by(Delivery.id)
    )
    jobs: dict[int, Job] = {}
    for delivery in waiting:
        row = rows[delivery.receiver_id]
        if row.id in jobs:
            continue
        delivery.state = "sending"
        jobs[row.id] = _begun(row, delivery, message.of_test(row.name, delivery.asked_by or "", address))
    return list(jobs.values())


# --- alarms


def _about_alarms(
    session: Session, rows: dict[int, Receiver], free: set[int], address: str, days_off: frozenset[date], now: datetime
) -> list[Job]:
    stored = session.scalars(select(NotificationRoute.rule).where(NotificationRoute.enabled)).all()
    planned = [plan for plan in plans_in_force(session) if plan.receivers]
    raised = _active(session) if stored or planned else []
    windows = withheld_since(session, (each.at for each in raised))
    active = notify.after_maintenance(raised, windows, now)
    if not active:
        return []
    same = _same_address(rows)
    last = {number: max(filter(None, (rows[each].last_at for each in same[number])), default=None) for number in rows}
    calm = {each for number in _calm(session, now) if rows[number].last_at == last[number] for each in same[number]}
    receivers = {
        number: notify.Receiver(
            number,
            week(map(HoursIn.model_validate, row.quiet)),
            row.away_until,
            last[number],
            unreached=row.failures > 0,
            busy=not same[number] <= free,
            spare=number in calm,
        )
        for number, row in rows.items()
    }
    routes = [Rule.model_validate(rule).value() for rule in stored]
    if planned:
        routes += _of_plans(session)
    groups = {row.id: group_of(row) for row in queries.groups(session)}
    today = now.astimezone(plant_zone()).date()
    off = days_off_of(session, {today.year, (today - notify.DAY).year}, days_off)
    found = notices(routes, receivers, active, _record(session, active, same, now), now, plant_zone(), off, groups)
    found = list({min(same[notice.receiver]): notice for notice in reversed(found)}.values())  # one to each address
    found.sort(
        key=lambda notice: rows[notice.receiver].failures
    )  # many that fail keep nobody waiting who can be reached
    places = {each.id: (URGENCY.index(each.tone), each.id) for each in active}
    first = [notice._replace(alarms=tuple(sorted(notice.alarms, key=places.__getitem__))) for notice in found]
    picture = cache(partial(_picture, session))  # of many receivers, the same
    return [_alarm_job(session, rows[notice.receiver], notice, address, picture) for notice in first[:MOST_AT_ONCE]]


def _same_address(rows: Mapping[int, Receiver]) -> dict[int, set[int]]:
    """For each receiver all that lead to the same person or place."""
    led = defaultdict[tuple[str, str], set[int]](set)
    for number, row in rows.items():
        led[row.means, row.address.casefold() if row.means == "mail" else row.address].add(number)
    return {number: numbers for numbers in led.values() for number in numbers}


def _calm(session: Session, now: datetime) -> set[int]:
    """Receivers whose last message of this minute is on record, and had no alarm that stops a machine."""
    of_last = (Announced.receiver_id == Receiver.id) & (Announced.at == Receiver.last_at)
    last = select(Receiver.id, Alarm.kind).join(Announced, of_last).join(Alarm, Alarm.id == Announced.alarm_id)
    tones = defaultdict[int, set[str]](set)
    for number, kind in session.execute(
        last.where(Receiver.last_at > now - notify.GAP, Receiver.deleted_at.is_(None)).distinct()
    ):
        tones[number].add(kind_named(kind).tone)
    return {number for number, of in tones.items() if "stop" not in of}


def _of_plans(session: Session) -> list[Route]:
    """A route for each reaction plan that names receivers, of the active alarms that it holds for."""
    reactions, those = Reactions(session), defaultdict[int, set[int]](set)
    receivers: dict[int, tuple[int, ...]] = {}
    rows = session.execute(
        select(Alarm.id, Alarm.kind, Alarm.data, Characteristic.key)
        .outerjoin(Characteristic, ITS_CHARACTERISTIC)
        .where(Alarm.acknowledged_at.is_(None))
        .order_by(Alarm.id.desc())
        .limit(MOST_ALARMS)
    )
    for number, kind, data, key in rows:
        plan = reactions.for_trouble(trouble_of(kind, key, data))
        if plan is not None and plan.receivers:
            those[plan.id].add(number)
            receivers[plan.id] = tuple(plan.receivers)
    return [
        Route((Step(NEVER, receivers[plan]),), only=frozenset(numbers), hold_off=HOLD_OFF)
        for plan, numbers in those.items()
    ]


def _picture(session: Session, number: int) -> bytes | None:
    return of_last_readings(session, alarm(session, number))


def _alarm_job(
    session: Session, row: Receiver, notice: Notice, address: str, picture: Callable[[int], bytes | None]
) -> Job:
    listed: list[AlarmRow] = [alarm(session, number) for number in notice.alarms[: message.MOST_IN_WORDS]]
    groups = [each.name for each in queries.groups(session) if each.id in notice.unattended]
    made = message.of_alarms(listed, len(notice.alarms), notice.again, address, Reactions(session), groups)
    if row.means == "mail":
        made = replace(made, picture=picture(notice.alarms[0]))
    return _job(session, row, "alarms", made, alarms=notice.alarms)


def _active(session: Session) -> list[Raised]:
    rows = session.execute(
        select(Alarm.id, Alarm.kind, Machine.key, Characteristic.key, Alarm.tool_memory, Alarm.raised_at)
        .join(Machine, Machine.id == Alarm.machine_id)
        .outerjoin(Characteristic, ITS_CHARACTERISTIC)
        .where(Alarm.acknowledged_at.is_(None))
        .order_by(Alarm.id.desc())
        .limit(MOST_ALARMS)
    )
    return [
        Raised(number, kind, kind_named(kind).tone, machine, characteristic, tool, at)
        for number, kind, machine, characteristic, tool, at in rows
    ]


def _record(session: Session, active: Iterable[Raised], same: Mapping[int, set[int]], now: datetime) -> Record:
    """Announcements of the active alarms, and of the same causes lately, to each receiver or to the same address."""
    causes = {each.cause for each in active}
    rows = session.execute(
        select(
            Announced.alarm_id,
            Announced.receiver_id,
            Announced.at,
            Alarm.kind,
            Machine.key,
            Characteristic.key,
            Alarm.tool_memory,
        )
        .join(Alarm, Alarm.id == Announced.alarm_id)
        .join(Machine, Machine.id == Alarm.machine_id)
        .outerjoin(Characteristic, ITS_CHARACTERISTIC)
        .where(or_(Announced.at > now - CHATTER, Alarm.acknowledged_at.is_(None)))
        .order_by(Announced.at)
    ).all()
    known = {(number, each): at for number, receiver, at, *_cause in rows for each in same.get(receiver, ())}
    of_causes = {
        (cause, each): at
        for _number, receiver, at, *names in rows
        if (cause := (names[0], names[1], names[2], names[3])) in causes
        for each in same.get(receiver, ())
    }
    return Record(known, of_causes)


# --- receivers that fail


def _about_receivers(
    session: Session, rows: dict[int, Receiver], free: set[int], address: str, now: datetime
) -> list[Job]:
    """Messages to receivers that are reached about those that are not."""
    due = failing.to_report(session, rows, free, _same_address(rows), now)
    return [
        _job(session, row, "receivers", message.of_receivers(fail, address), receivers=[each.id for each in fail])
        for row, fail in due[:MOST_AT_ONCE]
    ]


def _was_reported(row: Receiver, numbers: Iterable[int], now: datetime) -> None:
    """Note that a receiver has the message that these fail; what can hold back no other message is forgotten."""
    kept = {
        str(number): at.isoformat() for number, at in failing.reported_at(row).items() if at > now - timedelta(days=31)
    }
    row.reported = kept | {str(number): now.isoformat() for number in numbers}


# --- changes


def _about_changes(session: Session, row: Receiver, address: str) -> Job | None:
    """The next changes for a webhook, in the order of the commits; None where there are none."""
    if not row.events:
        return None
    events = session.execute(
        select(Event.id, Event.at, Event.changes).where(Event.id > row.cursor).order_by(Event.id).limit(MOST_EVENTS)
    ).all()
    if not events:
        return None
    oldest = session.scalars(select(func.min(Event.id))).one() or 0
    last, changes = row.cursor, list[dict[str, Any]]()
    for number, at, published in events:
        mine = [message.change(number, at, said, address) for said in published if said.get("kind") in row.events]
        if changes and len(changes) + len(mine) > MOST_CHANGES:
            break
        changes += mine
        last = number
    if not changes:
        row.cursor = last
        return None
    return _job(session, row, "changes", message.of_changes(changes, last, gap=oldest > row.cursor + 1), cursor=last)


# --- the end of a delivery


def end(session: Session, job: Job, answer: Answer) -> None:
    """Keep what came of a delivery; a receiver that was not reached pauses, the longer the more often it fails.

    What was delivered stays so.
    """
    now: datetime = session.scalars(select(func.clock_timestamp())).one()
    delivery = session.get(Delivery, job.delivery, with_for_update=True, populate_existing=True)
    row = session.get(Receiver, job.receiver, with_for_update=True, populate_existing=True)
    if delivery is None or row is None or delivery.state == "delivered":
        return
    delivery.state = "delivered" if answer.delivered else "failed"
    delivery.ended_at, delivery.answer = now, answer.text
    row.busy_until = None
    failed = row.failures >= ENOUGH_FAILURES
    if answer.delivered:
        row.works()
        _was_reported(row, delivery.receivers, now)
        _arrived(session, row, job, now)
    else:
        row.failing_since, row.failure = row.failing_since or now, answer.text
        row.failures += 1
        row.retry_at = now + pause_after(row.failures)
        if answer.perhaps and job.alarms:
            row.last_at = now  # it may have arrived: the next message waits its minute
    if failed != (row.failures >= ENOUGH_FAILURES):
        publish(session, {"kind": "notifications"})
    of_browser = {"person": row.person_id} if row.means == "browser" else {}
    publish(session, {"kind": "delivery", "id": job.delivery, **of_browser})


def _arrived(session: Session, row: Receiver, job: Job, now: datetime) -> None:
    if job.cursor is not None:
        row.cursor = max(row.cursor, job.cursor)
    if job.shift_end is not None:
        row.shift_reported = job.shift_end
    if not job.alarms:
        return
    row.last_at = now
    values = [{"alarm_id": number, "receiver_id": row.id, "at": now} for number in job.alarms]
    added = insert(Announced).values(values)
    session.execute(
        added.on_conflict_do_update(index_elements=["alarm_id", "receiver_id"], set_={"at": added.excluded.at})
    )


def forget_old(session: Session) -> None:
    """Delete deliveries that are older than `KEPT`, and what was announced of alarms that are acknowledged that long."""
    before = func.now() - KEPT
    session.execute(delete(Delivery).where(Delivery.asked_at < before))
    old = select(Alarm.id).where(Alarm.id == Announced.alarm_id, Alarm.acknowledged_at.is_not(None))
    session.execute(delete(Announced).where(Announced.at < before, old.exists()))
