"""The reaction plan of an alarm, and what it asks for when the alarm is acknowledged. Never writes."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session

from app.core.reaction import Scope, Trouble, most_specific
from app.errors import FieldError
from app.language.i18n import _
from app.loop.alarm_response.queries import AlarmRow
from app.loop.tables.reactions import CatalogueEntry, ReactionPlan

Sort = Literal["cause", "action"]


class Handled(NamedTuple):
    """Cause and corrective action, by their numbers in the catalogue."""

    cause: int | None = None
    corrective_action: int | None = None


def plans_in_force(session: Session) -> list[ReactionPlan]:
    """The last version of each plan that is not withdrawn, in the order of their numbers."""
    last = select(ReactionPlan.id, func.max(ReactionPlan.version)).group_by(ReactionPlan.id)
    newest = tuple_(ReactionPlan.id, ReactionPlan.version).in_(last)
    query = select(ReactionPlan).where(newest, ReactionPlan.ended.is_(False)).order_by(ReactionPlan.id)
    return list(session.scalars(query))


def trouble_of(kind: str, characteristic: str | None, data: Mapping[str, Any]) -> Trouble:
    """An alarm as plans are found for it; one about a tool is of the characteristic that has raised it."""
    rules = [signal["rule"] for signal in data.get("signals") or ()]
    return Trouble(characteristic or data.get("characteristic"), kind, rules)


def scope_of(plan: ReactionPlan) -> Scope:
    """The alarms that a plan is for."""
    return Scope(plan.characteristic, plan.kind, plan.rule)


class Reactions:
    """The plans and the catalogue as one request sees them; asked of the database once, and only if needed."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @cached_property
    def _plans(self) -> list[tuple[Scope, ReactionPlan]]:
        return [(scope_of(plan), plan) for plan in plans_in_force(self._session)]

    @cached_property
    def _entries(self) -> dict[int, CatalogueEntry]:
        found = self._session.scalars(select(CatalogueEntry).order_by(CatalogueEntry.name, CatalogueEntry.id))
        return {entry.id: entry for entry in found}

    def for_trouble(self, trouble: Trouble) -> ReactionPlan | None:
        """The plan in force for an alarm."""
        return most_specific(self._plans, trouble)

    def plan_of(self, row: AlarmRow) -> ReactionPlan | None:
        """The plan of an alarm: while it is active the one in force, afterwards the version that it was handled with."""
        alarm = row.alarm
        if alarm.acknowledged_at is None:
            key = row.characteristic.key if row.characteristic else None
            return self.for_trouble(trouble_of(alarm.kind, key, alarm.data))
        if alarm.reaction_plan is None:
            return None
        return self._session.get(ReactionPlan, (alarm.reaction_plan, alarm.reaction_version))

    def offered(self, sort: Sort) -> list[tuple[str, str]]:
        """The causes or corrective actions to choose from: number and name, by name."""
        return [(str(each.id), each.name) for each in self._entries.values() if self._is(each, sort)]

    def needs(self, plan: ReactionPlan | None, sort: Sort) -> bool:
        """Tell if the plan asks for it. Where the catalogue offers nothing, nothing is asked for: nobody could answer."""
        if plan is None or not (plan.cause_needed if sort == "cause" else plan.action_needed):
            return False
        return bool(self.offered(sort))

    def name_of(self, number: int | None) -> str | None:
        """The name of a cause or corrective action, a retired one too."""
        entry = self._entries.get(number) if number is not None else None
        return None if entry is None else entry.name

    def wrong(self, row: AlarmRow, handled: Handled) -> list[FieldError]:
        """Errors: the plan asks for what is missing, or the catalogue does not offer what was chosen."""
        plan = self.plan_of(row)
        errors = []
        asked: tuple[tuple[str, Sort, int | None], ...] = (
            ("cause", "cause", handled.cause),
            ("corrective_action", "action", handled.corrective_action),
        )
        for field, sort, number in asked:
            if number is None and plan is not None and self.needs(plan, sort):
                text = _("The reaction plan “{name}” asks for a corrective action: choose one")
                if sort == "cause":
                    text = _("The reaction plan “{name}” asks for a cause: choose one")
                errors.append(FieldError(field, text.format(name=plan.name)))
            elif number is not None and not self._is(self._entries.get(number), sort):
                errors.append(FieldError(field, _("is not one that the catalogue offers: {n}").format(n=number)))
        return errors

    @staticmethod
    def _is(entry: CatalogueEntry | None, sort: str) -> bool:
        return entry is not None and entry.sort == sort and entry.retired_at is None
