"""Pages: the licences of everything of others that runs here, and their texts."""

from functools import cache

from fastapi import APIRouter, Request, Response

from app.access.deps import require
from app.errors import NotFound
from app.language.i18n import _
from app.views.licences.libraries import libraries
from app.views.licences.postgresql import NAME, TEXT
from app.web.templates import page

router = APIRouter(include_in_schema=False)


@router.get("/licences", dependencies=[require("viewer")])
def licences_page(request: Request) -> Response:
    """List every distribution that is installed and that Inband needs, with its version and its licence."""
    return page(request, "licences/licences.html", libraries=libraries().values(), postgresql=NAME)


@router.get("/licences/{library}", dependencies=[require("viewer")])
def texts_page(request: Request, library: str) -> Response:
    """The texts that a distribution carries."""
    found = libraries().get(library)
    if found is None and library != NAME:
        raise NotFound(
            _("No library called {name} is installed.").format(name=repr(library)),
            _("The page Licences lists them all."),
        )
    texts = _texts(library)
    return page(request, "licences/texts.html", name=library, library=found, texts=texts)


@cache
def _texts(name: str) -> list[tuple[str, str]]:
    if name == NAME:
        return [("COPYRIGHT", TEXT)]
    return libraries()[name].texts()
