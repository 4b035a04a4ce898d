"""An error as a page: what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse

from app.web.templates import page


def problem_page(
    request: Request, problem: Mapping[str, Any], headers: Mapping[str, str] | None = None
) -> HTMLResponse:
    """The page for an RFC 9457 problem (`title`, `status`, `detail`, `errors`, `what_to_do`, `incident`)."""
    whole = {"detail": "", "errors": [], "what_to_do": None, "incident": None} | dict(problem)
    return page(request, "problem.html", status=int(problem["status"]), headers=dict(headers or {}), problem=whole)
