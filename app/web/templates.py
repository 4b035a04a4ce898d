"""Pages: Jinja2 templates under `frontend/templates` with our filters, the assets' URLs and the language of the request.

A page is answered with `page(request, "plant.html", machines=…)`. The templates find in every context what the layers
around the route have put into `request.state`: `person` (name, role; None if nobody is signed in), `csrf` (the token
for forms), `to_do` (how many things wait for a person, or None if not known). `chosen_machine` is carried through the doors.
"""

from __future__ import annotations

import re
import weakref
from functools import cache
from http import HTTPStatus
from threading import Lock
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape
from starlette.requests import Request
from starlette.responses import HTMLResponse

from app import HOUSE, __version__
from app.db.replica import Replica
from app.errors import InbandError
from app.language import formatting, i18n, short, times
from app.web import cards, states, theme, usual_periods
from app.web.assets import Assets
from app.web.doors import door_of, machine_of, search_words, way_to
from app.web.forms import FieldErrors, by_field
from app.web.help_ways import help_of
from app.web.page_queries import kept_period, said_period
from app.web.paging import address
from app.web.request_log import note_reason
from app.web.terms import term_of

if TYPE_CHECKING:
    from collections.abc import MutableMapping

TEMPLATE_DIR = HOUSE / "frontend" / "templates"
THEME_COOKIE = "inband_theme"
TELL_LAG = 2.0
"""Seconds that the copy of the database may be behind before pages say so."""


@cache
def assets() -> Assets:
    """The static files of this process."""
    return Assets()


class OneByOne(Environment):
    """An environment in which one thread compiles a template, while others that need it wait.

    After a start all tablets of a plant ask for their pages at once, and twenty threads compiled the same templates twenty times.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._compiling = Lock()

    def _load_template(self, name: str, globals: MutableMapping[str, Any] | None) -> Template:  # noqa: A002 - its name in jinja2
        if self.cache is None or (weakref.ref(self.loader), name) in self.cache:
            return super()._load_template(name, globals)
        with self._compiling:
            return super()._load_template(name, globals)


def breaking(key: str) -> Markup:
    """A key or a path that breaks after its separators alone, not in the middle of a word.

    >>> breaking("correction/lathe-2")
    Markup('correction/<wbr>lathe-2')
    """
    return Markup(re.sub("([/_.])", r"\1<wbr>", str(escape(key))))  # noqa: S704 - escaped


@cache
def environment() -> Environment:
    """The one Jinja2 environment: escaped, strict about missing names, translated. Made before threads ask for it."""
    env = OneByOne(
        loader=FileSystemLoader(TEMPLATE_DIR),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,  # else each page asks the disk about each of its templates
        extensions=["jinja2.ext.i18n", "jinja2.ext.do", "jinja2.ext.loopcontrols"],
    )
    env.install_gettext_callables(i18n._, i18n.ngettext, newstyle=True)  # type: ignore[attr-defined]
    env.filters.update(
        labelled=cards.labelled,
        um=formatting.um,
        read_um=formatting.read_um,
        read_in_um=formatting.read_in_um,
        um_limit=formatting.um_limit,
        tolerance=lambda of: formatting.tolerance_um(of.half, of.natural_limit),
        mm=formatting.mm,
        in_um=formatting.in_um,
        deserved=lambda of, deviation=None: formatting.deserved(of.half, deviation),
        plain_um=formatting.plain_um,
        signed=formatting.signed,
        signed_grouped=formatting.signed_grouped,
        beside=formatting.beside,
        fixed=formatting.fixed,
        probability=formatting.probability,
        percent=formatting.percent,
        in_percent=formatting.in_percent,
        short=formatting.short,
        grouped=formatting.grouped,
        breaking=breaking,
        when=formatting.when,
        as_field=usual_periods.field,
        ago=formatting.ago,
        in_short=short.in_short,
    )
    env.globals.update(
        address=address,
        door_of=door_of,
        help_of=help_of,
        term_of=term_of,
        way_to=way_to,
        search_words=search_words,
        asset=assets().url,
        assets=assets(),
        theme=theme,
        states=states,
        inband_version=__version__,
        plant_zone=times.plant_zone,
        usual_periods=usual_periods.usual_periods,
    )
    return env


def chosen_theme(request: Request) -> str:
    """`light`, `dark` or `auto` (as the system has it), by the cookie that the theme switch sets."""
    chosen = request.cookies.get(THEME_COOKIE, "auto")
    return chosen if chosen in ("light", "dark") else "auto"


def _replica_lag(request: Request) -> float | None:
    """Seconds that charts and reports are old, where that is worth a word."""
    replica: Replica | None = getattr(getattr(request.scope.get("app"), "state", None), "replica", None)
    return replica.behind if replica is not None and replica.usable and (replica.behind or 0) >= TELL_LAG else None


def _plant(request: Request) -> str:
    """Name of the plant, where there are several; an error before the application has none."""
    app = request.scope.get("app")
    return str(getattr(getattr(app.state, "settings", None), "plant", "")) if app else ""


def render(request: Request, template: str | Template, **context: Any) -> str:
    """The text of a template for this request."""
    state = request.state
    language = i18n.negotiate(request.headers.get("accept-language"))
    with i18n.speaking(language):
        return (
            environment()
            .get_template(template)
            .render(
                {
                    "request": request,
                    "path": request.url.path,
                    "language": language,
                    "chosen_theme": chosen_theme(request),
                    "person": getattr(state, "person", None),
                    "csrf": getattr(state, "csrf", ""),
                    "refusal": None,
                    "errors": FieldErrors(),
                    "newest_event": getattr(state, "newest_event", None),
                    "to_do": None,
                    "chosen_machine": None,
                    "plant": _plant(request),
                    "plant_root": request.scope.get("root_path", ""),
                    "replica_lag": _replica_lag(request),
                    "said_period": lambda: said_period(request.query_params),
                    "kept_period": lambda: kept_period(request.headers.get("cookie", "").encode("latin-1")),
                }
                | getattr(state, "waiting", {})
                | context
            )
        )


def page(
    request: Request,
    template: str | Template,
    *,
    refusal: InbandError | None = None,
    status: int = HTTPStatus.OK,
    headers: dict[str, str] | None = None,
    **context: Any,
) -> HTMLResponse:
    """A whole page, or the part of one, as an answer. Pages show the state of now, so nobody keeps them.

    refusal: why the form that was sent is shown again, with its status. Templates find the sentences of its fields in `errors`;
    what none of them shows is said at the top by the frame of all pages.
    With a status of 400 and more nothing that the request has written is kept.
    """
    errors = context.get("errors")
    if errors is None:
        errors = by_field(refusal) if refusal else {}
    context |= {"refusal": refusal, "errors": errors if isinstance(errors, FieldErrors) else FieldErrors(errors)}
    status = refusal.status if refusal else status
    headers = dict(headers or {})
    if status >= HTTPStatus.BAD_REQUEST:
        request.state.refused = True
        for reason in context.values():
            if isinstance(reason, InbandError):
                note_reason(request.scope, reason)
                headers |= reason.headers  # when to try again
    else:
        named = request.query_params.get("machine")
        context = {"chosen_machine": machine_of(request.url.path, named), **context}
    return HTMLResponse(render(request, template, **context), status, headers={"Cache-Control": "no-store", **headers})
