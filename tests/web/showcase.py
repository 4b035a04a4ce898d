"""A page with every part of the kit on it, and the smallest server that carries it: for tests and for the eye."""

import asyncio
import itertools
import math
import random
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Mount, Route

from app.charts import to_plotly
from app.core.decision.limits import Limits, classify
from app.loop.timeline.figures import Event
from app.loop.tools.figures import OffsetChange, offset_figure
from app.views.characteristic import figures as charts
from app.views.characteristic import glance
from app.web.problem import problem_page
from app.web.security import SecurityHeaders
from app.web.templates import assets, environment, page

LIMITS = SimpleNamespace(
    zero_range=0.001, averaging_limit=0.0053, tolerance_width=0.016, wear_limit=0.3, confidence_limit=1.0
)
START = datetime(2026, 11, 21, 6, 0, tzinfo=UTC)
EDGES = Limits.of(LIMITS)


def story(count: int = 200, seed: int = 1) -> tuple[list[charts.Point], list[charts.Step], list[Event]]:
    """A shift on a lathe: wear, corrections, one part too large, a worn tool, a dirty stylus, a new tool."""
    chance = random.Random(seed)
    drift, average = 0.0, 0.0
    points: list[charts.Point] = []
    steps: list[charts.Step] = []
    marks: list[Event] = []
    for n in range(1, count + 1):
        drift += 0.0004
        deviation = drift + chance.gauss(0, 0.0009)
        if n == count * 3 // 10:
            deviation = 0.0112
        if n == count * 11 // 20:
            deviation = -0.0093
        if n == count * 7 // 10:
            deviation = 0.41
        if n == count * 17 // 20:
            deviation = -1.7
        zone = classify(deviation, EDGES)
        if zone in ("zero", "average"):
            average = average / 2 + deviation / 2
        amount = deviation if zone in ("full", "oversize", "undersize", "wear") else None
        if zone == "average" and abs(average) > 0.001:
            amount, average = average, 0.0
        if amount is not None:
            status = "held" if zone == "wear" else "applied" if n < count - 6 else "pending"
            steps.append(charts.Step(n, len(steps) + 1, -amount, status, f"/corrections/{len(steps) + 1}"))
            if zone != "wear":
                drift -= amount if zone in ("average", "full") else amount * 0.3
            average = 0.0 if zone != "wear" else average
        kinds = {"oversize": "Oversize", "undersize": "Undersize", "wear": "Tool worn", "probe_fault": "Probe fault"}
        if zone in kinds:
            kind = "tool_worn" if zone == "wear" else str(zone)
            marks.append(Event(n, kind, kinds[zone], f"/alarms/{n}", active=zone == "probe_fault"))
        if n == count * 3 // 4:
            marks.append(Event(n, "tool_change", "Tool T3 changed"))
            drift, average = 0.0, 0.0
        points.append(
            charts.Point(
                n,
                deviation,
                zone,
                average,
                START + timedelta(minutes=n),
                excluded=n == count // 5,
                link=f"/readings/{n}",
            )
        )
    return points, steps, marks


def thinned(blocks: int = 600, size: int = 4096, seed: int = 2) -> list[charts.Block]:
    """Millions of readings by their blocks, a few of them with something outside."""
    chance = random.Random(seed)
    made = []
    for i in range(blocks):
        mean = 0.0011 * math.sin(i / 40) + 0.0001 * chance.gauss(0, 1)
        low, high = mean - abs(chance.gauss(0.004, 0.001)), mean + abs(chance.gauss(0.004, 0.001))
        if i % 97 == 50:
            high = 0.0118 if i % 2 else 0.45
        made.append(charts.Block(i * size + 1, (i + 1) * size, low, high, mean, mean / 2))
    return made


class Stage:
    """Content that a test can change while the page is open."""

    def __init__(self) -> None:
        self.over = False
        self.reset()

    def reset(self) -> None:
        """As it is at first."""
        self.readings = 120
        self.alarms = 2
        self.events: list[str] = []
        self.broken = False
        self.silent = False


def showcase(stage: Stage | None = None) -> Starlette:
    """The application: `/` has everything, `/chart` only the zone chart."""
    stage = stage or Stage()
    text = Path(__file__).with_name("showcase.html").read_text()
    person = SimpleNamespace(name="Ana Petrović", role="operator", person_id=None)

    def home(request: Request) -> Response:
        request.state.person, request.state.csrf, request.state.waiting = person, "token", {"to_do": 2}
        points, _steps, _marks = story()
        template = environment().from_string(text)
        parts: dict[str, Any] = {
            "pictures": [
                (zone, glance.band_picture(d, LIMITS, average=m))
                for zone, d, m in (
                    ("average", 0.0031, 0.0012),
                    ("oversize", 0.0112, 0.002),
                    ("wear", -0.41, 0.0),
                    ("probe_fault", 1.7, None),
                    ("zero", -0.0004, -0.0002),
                )
            ],
            "nothing": glance.band_picture(None, LIMITS),
            "spark": glance.sparkline([p.deviation for p in points[:60]], LIMITS),
            "now": datetime.now(UTC) - timedelta(seconds=42),
            "only_chart": request.url.path == "/chart",
        }
        return page(request, template, **parts)

    def figure(request: Request) -> Response:
        if stage.broken:
            return JSONResponse({}, 503)
        query = request.query_params
        points, steps, marks = story()
        shown = points[: stage.readings] if query.get("live") else points
        common: dict[str, Any] = {
            "limits": LIMITS,
            "scale": query.get("scale", "zones"),
            "sizes": charts.SizeAxis(39.992),
            "width": int(query.get("width", 1240)),
        }
        if request.path_params["name"] == "zones":
            made = charts.zone_chart(shown, steps=steps, events=marks, **common)
        elif request.path_params["name"] == "empty":
            made = charts.zone_chart([], **common)
        elif request.path_params["name"] == "thinned":
            made = charts.zone_chart([], blocks=thinned(), **common)
        elif request.path_params["name"] == "histogram":
            counts = charts.histogram_counts([p.deviation for p in points], LIMITS)
            made = charts.histogram_figure(counts, LIMITS)
        elif request.path_params["name"] == "run":
            run = [charts.RunPoint(p.sequence, p.at, p.deviation, p.zone, p.excluded) for p in points[:90] if p.at]
            made = charts.run_figure(run, LIMITS, sizes=common["sizes"])
        else:
            total, changes = 0.0, []
            for step in steps:
                total += step.amount if step.status == "applied" else 0
                changes.append(
                    OffsetChange(START + timedelta(minutes=step.sequence), total, "correction", f"no. {step.number}")
                )
            changes.insert(30, OffsetChange(changes[30].at, 0.0, "change", "worn"))
            made = offset_figure(changes)
        return JSONResponse(to_plotly(made, "dark" if query.get("theme") == "dark" else "light"))

    async def events(request: Request) -> Response:
        while stage.silent and not stage.over:  # noqa: ASYNC110 - as behind a pulled cable; set by another thread
            await asyncio.sleep(0.05)

        async def stream() -> AsyncIterator[str]:
            yield ": hello\n\n"
            seen = len(stage.events)
            for tick in itertools.count():
                if stage.over:
                    return
                for event in stage.events[seen:]:
                    seen += 1
                    yield event
                if tick % 5 == 0 and not stage.silent:
                    yield "event: heartbeat\ndata: {}\n\n"
                await asyncio.sleep(0.05)

        return StreamingResponse(stream(), media_type="text/event-stream", headers={"Cache-Control": "no-store"})

    def part(request: Request) -> Response:
        return HTMLResponse(
            f'<p id="count">{stage.readings} readings</p><details id="more"><summary>More</summary>…</details>'
            '<a href="/somewhere">a link</a><input name="comment">'
        )

    def count(request: Request) -> Response:
        return page(request, "to_do_count.html", to_do=stage.alarms)

    def problem(request: Request) -> Response:
        request.state.person = person
        return problem_page(
            request,
            {
                "title": "The request cannot be used as it is",
                "status": 422,
                "detail": "The limits must lie one outside the other.",
                "errors": [{"field": "averaging_limit", "message": "R34 (5.3 µm) must be larger than R33 (6 µm)."}],
                "what_to_do": "Make R33 smaller or R34 larger.",
            },
        )

    return Starlette(
        routes=[
            Route("/", home),
            Route("/chart", home),
            Route("/figures/{name}", figure),
            Route("/part", part),
            Route("/todo/count", count),
            Route("/problem", problem),
            Route("/api/v1/events", events),
            Mount("/static", assets()),
        ],
        middleware=[Middleware(SecurityHeaders)],
    )
