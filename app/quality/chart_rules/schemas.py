"""Rules and their preview as JSON."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.quality.baselines.queries import Baseline
from app.quality.chart_rules import wording
from app.quality.chart_rules.places import Do, Place, Watched, chart_at, rules_at
from app.quality.chart_rules.queries import Preview, RuleTrial
from app.web.fields import LARGEST_SERIAL, Body, Reason


class RulesIn(Body):
    """The rules that are to watch; what is not named is switched off."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    rules: dict[Place, dict[RuleName, Do]] = Field(
        description="By chart: `main` (individuals or subgroup means), `scatter` (moving range, R or s), `ewma`, "
        "`moving_average`, `cusum`. `watch` keeps signals, `alarm` raises alarms too. On all but `main` the limits alone "
        "have a sense: `nelson_1`."
    )
    reason: Reason
    look_back: bool = Field(
        False,
        strict=True,
        description="Judge the readings since the period of the baseline too. Signals found in them raise no alarm.",
    )
    seen_version: Annotated[int, Field(strict=True, ge=0, le=LARGEST_SERIAL)] | None = Field(
        None, description="The version that is changed: 409 if another is in force meanwhile."
    )


class RuleOut(BaseModel):
    """A rule on a chart."""

    rule: RuleName
    name: str
    looks_for: Annotated[str, Field(description="The pattern that it looks for.")]
    causes: str = Field(description="What usually lies behind it.")
    do: Do | None = Field(description="null: it is off.")
    since: int | None = Field(description="It judges from the reading after this one on; null: with the baseline.")


class ChartRulesOut(BaseModel):
    """The rules that have a sense on one chart."""

    place: Place
    chart: Chart
    rules: Annotated[list[RuleOut], Field(description="The rules that have a sense on this chart.")]


class RulesOut(BaseModel):
    """The rules of a characteristic. Without a baseline in force they judge nothing."""

    characteristic: str
    version: int = Field(description="0: the default, which nobody has set: nelson_1 is watched and raises no alarm.")
    baseline: int | None = Field(description="The version that they judge by; null: none is in force.")
    charts: Annotated[list[ChartRulesOut], Field(description="The rules, chart by chart.")]
    at: datetime | None
    actor: str | None
    reason: str | None

    @classmethod
    def of(cls, key: str, watched: Watched, baseline: Baseline | None) -> "RulesOut":
        """As it is answered."""
        return cls(
            characteristic=key,
            version=watched.version,
            baseline=None if baseline is None else baseline.version,
            charts=[_chart_rules(watched, baseline, place) for place in Place if rules_at(baseline, place)],
            at=watched.at,
            actor=watched.actor,
            reason=watched.reason,
        )


def _chart_rules(watched: Watched, baseline: Baseline | None, place: Place) -> ChartRulesOut:
    chart, on = chart_at(baseline, place), watched.rules.get(place, {})
    rules = [
        RuleOut(
            rule=name,
            name=wording.name_of(name, chart),
            looks_for=wording.looks_for(name, chart),
            causes=wording.causes(name, chart),
            do=on[name].do if name in on else None,
            since=(on[name].since or None) if name in on else None,
        )
        for name in rules_at(baseline, place)
    ]
    return ChartRulesOut(place=place, chart=chart, rules=rules)


class TriedOut(BaseModel):
    """Number of signals on these points, and the number that chance alone explains."""

    signals: int = Field(description="Runs of points; one that goes on counts once.")
    points: int = Field(description="Points that were looked at.")
    points_inside: int = Field(
        description="Points that lie in a signal; of several rules together each counts once for every signal it lies in."
    )
    every: float | None = Field(
        description="Points from one signal to the next by chance alone; 1e9, not exact: that many or more; null: never."
    )
    per_1000: float = Field(description="Signals by chance alone on 1000 points.")
    expected: float = Field(description="Signals by chance alone on that many points.")
    exact: bool = Field(description="Whether the chance is known exactly.")
    more_than_chance: bool = Field(
        description="Chance alone gives that many signals less than once in a hundred times."
    )
    text: str


class TriedRuleOut(TriedOut):
    """One rule tried on one chart."""

    place: Place
    chart: Chart
    rule: RuleName
    do: Annotated[Do | None, Field(description="What it does today; null: it is off.")]


class PreviewOut(BaseModel):
    """Signals that every rule would have given on the last readings, judged by the baseline in force."""

    characteristic: str
    baseline: int | None = Field(description="null: none is in force, so nothing can be tried.")
    first_sequence: int | None
    last_sequence: int | None
    rules: Annotated[list[TriedRuleOut], Field(description="Every rule on its chart.")]
    together: TriedOut | None = Field(description="All rules that are switched on, at once.")

    @classmethod
    def of(cls, key: str, watched: Watched, found: Preview | None) -> "PreviewOut":
        """As it is answered."""
        if found is None:
            return cls(
                characteristic=key, baseline=None, first_sequence=None, last_sequence=None, rules=[], together=None
            )
        filled = found.window.count > 0
        return cls(
            characteristic=key,
            baseline=found.baseline.version,
            first_sequence=found.window.first if filled else None,
            last_sequence=found.window.last if filled else None,
            rules=[
                TriedRuleOut(
                    place=place,
                    chart=chart_at(found.baseline, place),
                    rule=name,
                    do=on.do if (on := watched.rules.get(place, {}).get(name)) is not None else None,
                    **_tried(tried),
                )
                for (place, name), tried in found.tried.items()
            ],
            together=TriedOut(**_tried(found.everything)),
        )


def _tried(tried: RuleTrial) -> dict[str, Any]:
    rate = 1 / tried.chance.every
    return {
        "signals": tried.signals,
        "points": tried.points,
        "points_inside": tried.inside,
        "every": 1 / rate if rate else None,
        "per_1000": 1000 * rate,
        "expected": tried.expected,
        "exact": tried.chance.exact,
        "more_than_chance": tried.more_than_chance,
        "text": wording.compared(tried),
    }
