"""Reaction plans: which one holds for an alarm, and the causes of alarms by how often they come (Pareto).

The most specific plan holds: of its characteristic before one of any, then one of its run rule, then one of its kind. So at most
one holds, as long as no two have the same scope.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from statistics import median
from typing import NamedTuple, TypeVar

Plan = TypeVar("Plan")


class Scope(NamedTuple):
    """Alarms that a plan is for; None: any. rule: a run rule of control charts, whose alarms are of the kind `signal`."""

    characteristic: str | None = None
    kind: str | None = None
    rule: str | None = None


class Trouble(NamedTuple):
    """An alarm. rules: the run rules that have raised it, oldest first."""

    characteristic: str | None
    kind: str
    rules: Sequence[str] = ()


def holds(scope: Scope, trouble: Trouble) -> bool:
    """Tell if a plan of this scope is for the alarm at all."""
    return (
        scope.characteristic in (None, trouble.characteristic)
        and scope.kind in (None, trouble.kind)
        and (scope.rule is None or scope.rule in trouble.rules)
    )


def most_specific(plans: Iterable[tuple[Scope, Plan]], trouble: Trouble) -> Plan | None:
    """The plan that holds for the alarm; None where there is none. Of several run rules the latest counts.

    >>> plans = [(Scope(), "any"), (Scope(kind="tool_worn"), "worn"), (Scope("d40"), "seat")]
    >>> most_specific(plans, Trouble("d40", "tool_worn")), most_specific(plans, Trouble("d35", "tool_worn"))
    ('seat', 'worn')
    """

    def rank(scope: Scope) -> tuple[bool, int, bool]:
        rule = -1 if scope.rule is None else len(trouble.rules) - 1 - list(reversed(trouble.rules)).index(scope.rule)
        return scope.characteristic is not None, rule, scope.kind is not None

    fitting = [(rank(scope), plan) for scope, plan in plans if holds(scope, trouble)]
    return max(fitting, key=lambda each: each[0])[1] if fitting else None


class Handled(NamedTuple):
    """An acknowledged alarm. cause: its number, None where none was given. Seconds from when it was raised.

    recovered: until the first reading after it that raises no alarm; None where none has come yet, or it is about no reading.
    """

    cause: int | None
    acknowledged: float
    recovered: float | None


class Share(NamedTuple):
    """One cause. alarms: with it; share, sum: of all alarms, 0 to 1, alone and with those before it. Times are medians, s.

    recovering: alarms of which the time to recover is known.
    """

    cause: int | None
    alarms: int
    share: float
    sum: float
    acknowledged: float
    recovered: float | None
    recovering: int


def pareto(handled: Iterable[Handled]) -> list[Share]:
    """The causes, the most frequent first; alarms without one come last, however many they are."""
    by_cause: dict[int | None, list[Handled]] = defaultdict(list)
    for each in handled:
        by_cause[each.cause].append(each)
    total, before = sum(map(len, by_cause.values())), 0
    shares = []
    for cause, those in sorted(by_cause.items(), key=lambda item: (item[0] is None, -len(item[1]), item[0] or 0)):
        before += len(those)
        known = [each.recovered for each in those if each.recovered is not None]
        shares.append(
            Share(
                cause,
                len(those),
                len(those) / total,
                before / total,
                median(each.acknowledged for each in those),
                median(known) if known else None,
                len(known),
            )
        )
    return shares
