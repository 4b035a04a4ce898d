"""Pages: the documents of `docs/`, for everyone who is signed in; nothing of them is in the database."""

from fastapi import APIRouter, Request, Response
from starlette.responses import FileResponse

from app.access.deps import require
from app.errors import NotFound
from app.language.i18n import _
from app.views.help.contents import groups
from app.views.help.queries import document, documents, files
from app.web.templates import page
from app.web.terms import DOCS

router = APIRouter(include_in_schema=False, dependencies=[require("viewer")])


@router.get("/help")
def contents_page(request: Request) -> Response:
    """List every document by what one wants to do."""
    return page(request, "help/contents.html", groups=groups())


@router.get("/help/{name:path}")
def document_page(request: Request, name: str) -> Response:
    """Show a document, or hand out a picture or a file that one of them names."""
    if name in files():
        return FileResponse(DOCS / name, media_type=files()[name])
    if name not in documents():
        raise NotFound(
            _("There is no page of help called {name}.").format(name=repr(name)),
            _("The page Help lists them all; the search field finds their words."),
        )
    return page(request, "help/document.html", document=document(name))
