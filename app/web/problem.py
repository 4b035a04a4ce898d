"""An error as a page: what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse

from app.errors import for_people
from app.language.i18n import _
from app.web.templates import page


def problem_page(
    request: Request, problem: Mapping[str, Any], headers: Mapping[str, str] | None = None
) -> HTMLResponse:
    """The page for an RFC 9457 problem (`title`, `status`, `detail`, `errors`, `what_to_do`, `request_id`)."""
    whole = {"detail": "", "errors": [], "what_to_do": None, "request_id": None} | dict(problem)
    whole["what_to_do"] = for_people(whole["what_to_do"])
    if whole["status"] == HTTPStatus.NOT_FOUND:
        whole["what_to_do"] = _(
            "Check the address, or start from the plant page: an old link may point to something deleted."
        )
    return page(request, "problem.html", status=int(problem["status"]), headers=dict(headers or {}), problem=whole)
