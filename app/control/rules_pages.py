"""Page: the rules of a characteristic, what each looks for, and how often it fires, before it is switched on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from app.characteristics import queries as characteristics
from app.characteristics.queries import Standing
from app.control import rules_queries
from app.control import rules_wording as wording
from app.control.queries import baseline_in_force
from app.control.rules_actions import set_rules
from app.control.rules_pictures import HEIGHT, WIDTH, Picture, picture
from app.control.rules_queries import Tried
from app.control.rules_schemas import RulesIn
from app.control.tables import Baseline
from app.control.watching import Do, Place, Rules, Setting, Watched, chart_at, drawn_at, rules_at, size_of
from app.core.spc.false_alarms import FalseAlarms, by_chance
from app.core.spc.points import Drawn
from app.core.spc.rules import NELSON, WESTERN_ELECTRIC, RuleName
from app.core.spc.shewhart import Chart
from app.errors import InbandError
from app.proof import queries as proof
from app.proof import wording as proof_wording
from app.statistics import wording as statistics
from app.web.deps import Caller, Engineer, FormDep, SessionDep, Viewer
from app.web.forms import by_field, parsed
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
class Row:
    """A rule on a chart, as a line of the table."""

    place: Place
    name: RuleName
    chart: Chart
    do: Do | None
    since: int | None
    chance: FalseAlarms
    tried: Tried | None
    picture: Picture = field(repr=False)

    @property
    def field(self) -> str:
        """Its name in the form."""
        return f"{self.place.value}.{self.name.value}"


def rows_of(rules: Rules, baseline: Baseline | None, found: rules_queries.Preview | None) -> list[Row]:
    """Every rule that has a sense on a chart of this baseline."""
    return [
        Row(
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
        return by_chance(Drawn(chart_at(None, place)), [name])
    return by_chance(drawn_at(baseline, place), [name], size_of(baseline))


def ticked(form: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """The rules that are on in the form, as the API takes them; whatever is neither watch nor alarm is off."""
    rules: dict[str, dict[str, str]] = {}
    for name, value in form.items():
        place, dot, rule = name.partition(".")
        if dot and place in set(Place) and value in set(Do):
            rules.setdefault(place, {})[rule] = value
    return rules


def typed(form: Mapping[str, str], before: Rules) -> Rules:
    """The same as rules, without what nobody knows; what was on before goes on from where it began."""
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
    standing = characteristics.characteristic_named(session, characteristic)
    watched = rules_queries.rules_in_force(session, standing.characteristic)
    rules = watched.rules
    if chosen is not None:
        rules = of_set(chosen, rules, baseline_in_force(session, standing.characteristic))
    return _rules(request, session, caller, standing, watched, rules, last)


def _rules(
    request: Request,
    session: Session,
    caller: Caller,
    standing: Standing,
    watched: Watched,
    rules: Rules,
    last: str,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
) -> Response:
    key = standing.characteristic.key
    found = rules_queries.preview(session, standing, rules, None if last == "all" else int(last))
    baseline = None if found is None else found.baseline
    failing = proof.failing()

    def link(**changes: Any) -> str:
        return f"/characteristics/{key}/rules?{urlencode({'last': last} | changes)}"

    return page(
        request,
        "control/rules.html",
        status=error.status if error else 200,
        characteristic=standing.characteristic,
        machine=standing.machine,
        watched=watched,
        unsaved=rules != watched.rules,
        rows=rows_of(rules, baseline, found),
        found=found,
        baseline=baseline,
        history=rules_queries.rules_history(session, standing.characteristic),
        last=last,
        link=link,
        form=form or {},
        problem=error,
        errors=by_field(error) if error else {},
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
    standing = characteristics.characteristic_named(session, characteristic)
    last = form.get("last", "")
    last = last if last in {"200", "1000", "all"} else "1000"
    before = rules_queries.rules_in_force(session, standing.characteristic)
    rules = typed(form, before.rules)
    if form.get("step") == "try":
        return _rules(request, session, caller, standing, before, rules, last, form)
    seen = form.get("seen_version", "")
    given = {
        "rules": ticked(form),
        "reason": form.get("reason", "").strip() or None,
        "look_back": form.get("look_back") == "true",
        "seen_version": int(seen) if seen.isdecimal() and len(seen) < 10 else seen or None,
    }
    try:
        with session.begin_nested():
            wanted = parsed(RulesIn, given)
            set_rules(
                session,
                standing,
                wanted.rules,
                wanted.reason,
                caller,
                look_back=wanted.look_back,
                seen=wanted.seen_version,
            )
    except InbandError as error:
        if error.status not in {409, 422}:
            raise
        return _rules(request, session, caller, standing, before, rules, last, form, error)
    return RedirectResponse(f"/characteristics/{standing.characteristic.key}/rules?last={last}", 303)
