"""The what-if as its page asks it: an address that says everything, lengths in µm, today's value where a field is empty."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any
from urllib.parse import urlencode

from app.core.context import ContextField
from app.core.parameters import Parameters
from app.core.period import Period
from app.files.formats import cell_values, periods
from app.language.formatting import short
from app.language.i18n import _
from app.language.times import plant_zone
from app.quality.what_if.queries import USUAL
from app.quality.what_if.schemas import MapIn, WhatIfIn
from app.web.choice import in_address
from app.web.forms import length, parsed

FIELDS = ("k", "r33", "r34", "factor", "delay", "effect", "last", "from", "to", "goal", "by")
NAMES = {
    "k": "weighting_factor",
    "r33": "zero_range",
    "r34": "averaging_limit",
    "from": "start",
    "to": "end",
    "goal": "criterion",
}
PERIODS = ("1000", "5000", "20000", "100000", "all")


def typed_from(query: Mapping[str, str]) -> dict[str, str]:
    """Typed values; the usual readings unless something else was chosen."""
    typed = {name: query.get(name, "").strip()[:40] for name in FIELDS}
    typed["effect"] = typed["effect"] or "1"
    typed["goal"] = typed["goal"] or "ppk"
    typed["by"] = typed["by"] if typed["by"] in set(ContextField) else ""
    if not typed["last"] and not typed["from"] and not typed["to"]:
        typed["last"] = str(USUAL)
    return typed


def request_of(typed: Mapping[str, str]) -> WhatIfIn:
    """The question. Raises `Invalid` with the fields of the API."""
    return parsed(WhatIfIn, _common(typed) | {"weighting_factor": number(typed["k"]), "zero_range": mm(typed["r33"])})


def map_request(typed: Mapping[str, str]) -> MapIn:
    """The map of the same period, R34 and factor."""
    return parsed(MapIn, _common(typed) | {"criterion": typed["goal"]})


def _common(typed: Mapping[str, str]) -> dict[str, Any]:
    effect, last = typed["effect"], typed["last"]
    delay = number(typed["delay"])
    return {
        "averaging_limit": mm(typed["r34"]),
        "factor": number(typed["factor"]),
        "delay": int(delay) if isinstance(delay, float) and delay.is_integer() else delay,
        "effect": None if effect == "measured" else number(effect),
        "last": 10**15
        if last == "all"
        else int(last)
        if last.isascii() and last.isdigit() and len(last) < 16
        else last,
        "from": moment(typed["from"], end=False),
        "to": moment(typed["to"], end=True),
    }


def number(text: str) -> float | str | None:
    """A number with a decimal point or comma; what is none is left for the schema to refuse.

    >>> number("2,5"), number("−1"), number(""), number("many")
    (2.5, -1.0, None, 'many')
    """
    return length(text)


def mm(text: str) -> float | str | None:
    """µm as they are typed, in mm.

    >>> mm("2.7"), mm("")
    (0.0027, None)
    """
    value = number(text)
    return round(value / 1000, 9) if isinstance(value, float) and abs(value) < 1e12 else value


def moment(text: str, *, end: bool) -> str | None:
    """A day or a moment as people type it, of the plant's clock; what is none is left for the schema to refuse."""
    try:
        at = periods.bound(text, plant_zone(), end=end)
    except cell_values.Unreadable:
        return text
    return at.isoformat() if at else None


def address(key: str, typed: Mapping[str, str], **changes: str) -> str:
    """The page with something else chosen; what is usual is not said."""
    usual = {"effect": "1", "goal": "ppk", "last": str(USUAL)}
    values = {name: value for name, value in {**typed, **changes}.items() if value and usual.get(name) != value}
    return f"/characteristics/{key}/what-if" + (f"?{urlencode(values)}" if values else "")


def again(key: str, changes: Mapping[str, float], evidence: Mapping[str, Any]) -> str:
    """The what-if that a proposal came from: the same settings on the same readings."""
    typed = {
        "k": f"{changes['weighting_factor']:.9g}" if "weighting_factor" in changes else "",
        "r33": f"{changes['zero_range'] * 1000:.9g}" if "zero_range" in changes else "",
        "r34": f"{changes['averaging_limit'] * 1000:.9g}" if "averaging_limit" in changes else "",
        "factor": f"{changes['factor']:.9g}" if "factor" in changes else "",
    }
    replayed = Period.through(*(datetime.fromisoformat(evidence[name]) for name in ("start", "end")))
    return address(key, typed | {name: text for name, text in in_address(replayed).items() if text})


def effects(chosen: str) -> list[tuple[str, str]]:
    """The share of a correction that acts, to choose from."""
    offered = [("1", _("in full")), ("measured", _("as measured"))]
    if chosen not in {"1", "measured"}:
        offered.append((chosen, _("by {share}").format(share=chosen)))
    return offered


def figure_query(given: WhatIfIn) -> str:
    """The same question for the figure."""
    query = given.model_dump(mode="json", by_alias=True, exclude_none=True)
    if given.effect is None:
        query["measured"] = "true"
    elif given.effect == 1:
        del query["effect"]
    return urlencode({name: f"{value:.9g}" if isinstance(value, float) else value for name, value in query.items()})


def placeholders(today: Parameters, delay: int | None) -> dict[str, str]:
    """Current values, for empty fields."""
    return {
        "k": f"{today.weighting_factor:.6g}",
        "r33": short(today.zero_range * 1000),
        "r34": short(today.averaging_limit * 1000),
        "factor": f"{today.factor:.6g}",
        "delay": str(delay or 0),
    }


def at_fields(errors: Mapping[str, str]) -> dict[str, str]:
    """Errors at the fields of the page."""
    names = {api: page for page, api in NAMES.items()}
    return {names.get(field, field): message for field, message in errors.items()}


def counts(chosen: str) -> list[tuple[str, str]]:
    """Choices for the number of readings."""
    offered = [
        (count, _("All readings") if count == "all" else _("The last {count}").format(count=count)) for count in PERIODS
    ]
    if chosen and chosen not in PERIODS:
        offered.append((chosen, _("The last {count}").format(count=chosen)))
    return [("", _("By date")), *offered]
