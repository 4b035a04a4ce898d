"""Page: the rules of a characteristic, what each looks for, and how often it fires, before it is switched on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.access.deps import Caller, Engineer, Viewer
from app.core.spc.false_alarms import FalseAlarms, by_chance
from app.core.spc.points import ChartSettings
from app.core.spc.rules import NELSON, WESTERN_ELECTRIC, RuleName
from app.core.spc.shewhart import Chart
from app.errors import InbandError
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import wording as statistics
from app.quality.baselines.queries import Baseline, baseline_in_force
from app.quality.chart_rules import queries, wording
from app.quality.chart_rules.actions import set_rules
from app.quality.chart_rules.pictures import HEIGHT, WIDTH, Picture, picture
from app.quality.chart_rules.places import (
    Do,
    Place,
    Rules,
    Setting,
    Watched,
    chart_at,
    rules_at,
    settings_at,
    size_of,
)
from app.quality.chart_rules.queries import RuleTrial
from app.quality.chart_rules.schemas import RulesIn
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.deps import FormDep, SessionDep
from app.web.forms import parsed
from app.web.templates import page

router = APIRouter(include_in_schema=False)

Last = Literal["200", "1000", "all"]
Set = Literal["limits", "nelson", "western"]
SETS: dict[Set, tuple[RuleName, ...]] = {
    "limits": (RuleName.NELSON_1,),
    "western": tuple(rule.name for rule in WESTERN_ELECTRIC),
    "nelson": tuple(rule.name for rule in NELSON),
}


@dataclass(frozen=True)
class RuleRow:
    """A rule on a chart, as a line of the table."""

    place: Place
    name: RuleName
    chart: Chart
    do: Do | None
    since: int | None
    chance: FalseAlarms
    tried: RuleTrial | None
    picture: Picture = field(repr=False)

    @property
    def field(self) -> str:
        """Its name in the form."""
        return f"{self.place.value}.{self.name.value}"


def rows_of(rules: Rules, baseline: Baseline | None, found: queries.Preview | None) -> list[RuleRow]:
    """Every rule that has a sense on a chart of this baseline."""
    return [
        RuleRow(
            place,
            name,
            chart := chart_at(baseline, place),
            None if (setting := rules.get(place, {}).get(name)) is None else setting.do,
            None if setting is None else setting.since or None,
            _chance(baseline, place, name),
            found.tried.get((place, name)) if found is not None else None,
            picture(name, chart),
        )
        for place in Place
        for name in rules_at(baseline, place)
    ]


def _chance(baseline: Baseline | None, place: Place, name: RuleName) -> FalseAlarms:
    if baseline is None:
        return by_chance(ChartSettings(chart_at(None, place)), [name])
    return by_chance(settings_at(baseline, place), [name], size_of(baseline))


def ticked(form: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """The rules that are on in the form, as the API takes them; whatever is neither watch nor alarm is off."""
    rules: dict[str, dict[str, str]] = {}
    for name, value in form.items():
        place, dot, rule = name.partition(".")
        if dot and place in set(Place) and value in set(Do):
            rules.setdefault(place, {})[rule] = value
    return rules


def typed(form: Mapping[str, str], before: Rules) -> Rules:
    """The same as rules, without what is not known; what was on before goes on from where it began."""
    rules: Rules = {}
    for place, named in ticked(form).items():
        for name, do in named.items():
            if name in set(RuleName):
                old = before.get(Place(place), {}).get(RuleName(name), Setting(Do.WATCH))
                rules.setdefault(Place(place), {})[RuleName(name)] = Setting(Do(do), old.since, old.back)
    return rules


def of_set(chosen: Set, before: Rules, baseline: Baseline | None) -> Rules:
    """The rules of a set on the main chart; those on other charts as they are."""
    main = before.get(Place.MAIN, {})
    names = [name for name in SETS[chosen] if name in rules_at(baseline, Place.MAIN)]
    return before | {Place.MAIN: {name: main.get(name, Setting(Do.WATCH)) for name in names}}


@router.get("/characteristics/{characteristic}/rules")
def rules_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    characteristic: str,
    last: Annotated[Last, Query()] = "1000",
    chosen: Annotated[Set | None, Query(alias="set")] = None,
) -> Response:
    """The rules, what they would have said of the last readings, and which are on. A set that is chosen is tried first."""
    current = characteristics.characteristic_named(session, characteristic)
    watched = queries.rules_in_force(session, current.characteristic)
    rules = watched.rules
    if chosen is not None:
        rules = of_set(chosen, rules, baseline_in_force(session, current.characteristic))
    return _rules(request, session, caller, current, watched, rules, last)


def _rules(
    request: Request,
    session: Session,
    caller: Caller,
    current: CurrentCharacteristic,
    watched: Watched,
    rules: Rules,
    last: str,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    key = current.characteristic.key
    preview = queries.preview(session, current, rules, None if last == "all" else int(last))
    baseline = None if preview is None else preview.baseline
    failing = proof.failing()

    def link(**changes: Any) -> str:
        return f"/characteristics/{key}/rules?{urlencode({'last': last} | changes)}"

    return page(
        request,
        "chart_rules/rules.html",
        refusal=error,
        characteristic=current.characteristic,
        machine=current.machine,
        watched=watched,
        unsaved=rules != watched.rules,
        rows=rows_of(rules, baseline, preview),
        found=preview,
        baseline=baseline,
        history=queries.rules_history(session, current.characteristic),
        last=last,
        link=link,
        form=form or {},
        size=(WIDTH, HEIGHT),
        place=Place,
        do=Do,
        wording=wording,
        said=statistics,
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
        may_edit=caller.may("engineer"),
    )


@router.post("/characteristics/{characteristic}/rules")
def send_rules(request: Request, session: SessionDep, caller: Engineer, characteristic: str, form: FormDep) -> Response:
    """Try what is ticked (`step` = try), or switch it on. Nothing is changed unless all of it is understood."""
    current = characteristics.characteristic_named(session, characteristic)
    last = form.get("last", "")
    last = last if last in {"200", "1000", "all"} else "1000"
    before = queries.rules_in_force(session, current.characteristic)
    rules = typed(form, before.rules)
    if form.get("step") == "try":
        return _rules(request, session, caller, current, before, rules, last, form)
    seen = form.get("seen_version", "")
    fields = {
        "rules": ticked(form),
        "reason": form.get("reason", "").strip() or None,
        "look_back": form.get("look_back") == "true",
        "seen_version": int(seen) if seen.isdecimal() and len(seen) < 10 else seen or None,
    }
    try:
        with session.begin_nested():
            request_body = parsed(RulesIn, fields)
            set_rules(
                session,
                current,
                request_body.rules,
                request_body.reason,
                caller,
                look_back=request_body.look_back,
                seen=request_body.seen_version,
            )
    except InbandError as error:
        if error.status not in {409, 422}:
            raise
        return _rules(request, session, caller, current, before, rules, last, form, error)
    return RedirectResponse(f"/characteristics/{current.characteristic.key}/rules?last={last}", 303)
