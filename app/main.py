"""The wiring and nothing else: `create_app` puts the house together."""

import asyncio
import gc
import logging
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from importlib import import_module
from threading import Event

from fastapi import APIRouter, FastAPI, Request
from prometheus_client import Histogram
from starlette.middleware.gzip import GZipMiddleware

from app.access.bodies import read_after_recognition
from app.access.deps import recognise
from app.access.keys import KeyRing
from app.access.queries import still_granted
from app.access.recognition import Lookups
from app.core.compile_now import compile_each
from app.db.connections import Connections
from app.db.engine import Database
from app.db.replica import replica_of
from app.files.formats.rotary_words import known_words
from app.jobs.actions import PeriodicJob
from app.jobs.runner import JobRunner
from app.language.times import use_zone
from app.loop.calibration import jobs
from app.loop.connections import jobs as connection_jobs
from app.loop.connections import late_readings, server_away
from app.loop.control_plan import jobs as control_plan_jobs
from app.loop.faults.actions import report_touch_count
from app.loop.machines.keys import caller_of_key
from app.loop.notifications.notifier import Notifier
from app.loop.present_context import actions as present_context
from app.loop.readings import api as readings
from app.loop.readings import results_actions
from app.loop.readings.door import Directory, ReadingsDoor
from app.loop.readings.writer import columnar
from app.loop.readings.writer.group_commit import Writer
from app.loop.tools import jobs as tool_jobs
from app.loop.tools.untaken import Watch
from app.memory import give_back_free_memory, keep_few_arenas
from app.plants import pages as plants_pages
from app.plants.prefix import UnderPrefix
from app.plants.serving import Application, Plants
from app.quality.capability import actions as capability_actions
from app.quality.chart_signals import jobs as signal_jobs
from app.quality.proof import queries as proofs
from app.quality.wear import actions as wear_actions
from app.settings import Settings
from app.views.reports import actions as report_actions
from app.views.reports.worker import ReportWorker
from app.views.shift.mail import shift_words
from app.views.to_do.queries import COUNT as TO_DO_COUNT
from app.views.wall import pages as wall_pages
from app.web import health
from app.web.live import Live
from app.web.openapi import document
from app.web.own_changes import OwnChanges
from app.web.page_queries import PageQueries
from app.web.problems import add_problem_handlers
from app.web.request_log import RequestLog
from app.web.security import SecurityHeaders
from app.web.templates import assets, environment

log = logging.getLogger(__name__)

TURN = 0.0005
"""Seconds that a thread computes on while another one waits for the interpreter.

A reading waits for its turn several times on its way, each time as long as this while a report or a page computes. Python's own
5 ms made readings wait three times as long beside reports (``bench/strangers.py``); a shorter turn than this helped no more.
"""

WITH_ROUTES = """
    loop.machines.api loop.faults.api loop.connections.api loop.connections.touch_tests.api
    loop.characteristics.api loop.expansion.api
    views.characteristic.figures_api
    loop.summaries.api
    quality.capability.api
    views.compare.api views.overview.api views.shift.api views.search.api
    quality.proof.api quality.wear.api
    geometry.work_zero.api geometry.alignment.api geometry.alignment.pictures_api
    views.reports.api views.reports.jobs_api views.reports.points_api
    quality.baselines.api quality.control_charts.api quality.count_charts.api quality.chart_rules.api
    quality.what_if.api quality.ledger.api quality.trial.api quality.sampling.api quality.temperature.api
    quality.chart_signals.api
    loop.readings.api:push
    views.search.readings_api
    loop.readings.aqdef.api loop.readings.table_api loop.readings.api loop.readings.by_hand.api loop.tools.api
    loop.calibration.api
    quality.gauge_studies.api
    geometry.rotary_axes.protocol_api geometry.rotary_axes.plan_api geometry.rotary_axes.api
    loop.tools.edges_api
    geometry.geometric_form.api
    loop.programs.api loop.tools.text_api loop.alarm_response.api
    views.alarm_load.api
    loop.reactions.api loop.quarantine.api loop.control_plan.api loop.present_context.api loop.notes.api
    loop.maintenance.api loop.notifications.api
    access.events_api access.api
    loop.machines.keys_api
    access.keys_api access.screens_api access.audit.api
    web.health web.api_docs
    views.plant.machine_pages
    loop.connections.pages loop.connections.touch_tests.pages
    views.plant.pages views.plant.trying_pages views.station.pages views.search.pages views.to_do.pages
    views.wall.pages views.compare.pages views.overview.pages views.shift.pages views.characteristic.pages
    quality.control_charts.pages quality.baselines.pages quality.count_charts.pages quality.chart_rules.pages
    quality.what_if.pages quality.ledger.pages quality.trial.pages quality.sampling.pages
    quality.temperature.pages quality.chart_signals.pages
    views.characteristic.capability_pages
    views.characteristic.six_pack
    views.alarm_load.pages
    loop.reactions.pages loop.alarm_response.pages loop.quarantine.pages loop.control_plan.pages loop.notes.pages
    loop.maintenance.pages
    views.approvals.pages
    loop.tools.text_pages loop.tools.edge_pages loop.tools.pages loop.calibration.pages
    quality.gauge_studies.pages
    geometry.geometric_form.pages geometry.alignment.pages geometry.work_zero.pages geometry.rotary_axes.new_pages
    geometry.rotary_axes.plan_pages geometry.rotary_axes.pages
    access.pages
    views.set_up.pages
    loop.readings.importing.pages
    quality.proof.pages
    views.help.pages views.licences.pages views.reports.pages views.reports.jobs_pages
"""
"""The modules with routes, JSON first, in the order in which addresses are compared: the pages /alarms/load and /alarms/causes
come before those of alarms by their number. A module brings its `router`, or what is named behind a colon."""


def _router(name: str) -> APIRouter:
    module, _colon, attribute = name.partition(":")
    router: APIRouter = getattr(import_module(f"app.{module}"), attribute or "router")
    return router


# Each part of the shop floor brings its JSON routes (api) and its pages.
ROUTERS = tuple(map(_router, WITH_ROUTES.split()))

# What is done once a minute; see app.jobs.
JOBS: tuple[PeriodicJob, ...] = (
    *tool_jobs.JOBS,
    wear_actions.JOB,
    jobs.JOB,
    present_context.JOB,  # before what looks for context that is missing
    control_plan_jobs.JOB,
    report_actions.JOB,
    signal_jobs.JOB,
    capability_actions.JOB,
    results_actions.JOB,
)


def jobs_of(settings: Settings) -> tuple[PeriodicJob, ...]:
    """All of them, as the settings have it."""
    untaken = Watch(settings.corrections_taken_within, settings.corrections_not_taken_most)
    away = (server_away.JOB, connection_jobs.job(settings.bridge_silent_after), late_readings.JOB)
    return *away, *JOBS, untaken.job()


NOT_COMPRESSED = (
    "text/event-stream",  # each event leaves at once
    "application/pdf",
    "application/zip",
    "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "image/png",
)


def keep_for_good() -> None:
    """Exempt all present objects from garbage collection, during which everybody waits.

    At the start, which halves the p99; and when the proof has brought in the compiler, where a full round would take a
    tenth of a second at best, and half a second while pages compute. So nothing is collected before: that is such a round.
    """
    gc.freeze()


def create_app(settings: Settings | None = None, ending: Callable[[], None] = lambda: None) -> Plants:
    """Make the application for one server process. Without settings they come from the environment.

    ending: called when the application begins to end.
    """
    settings = settings or Settings()
    keep_few_arenas()
    if settings.database_url is None:
        raise RuntimeError("no database: `inband serve` starts one, or set INBAND_DATABASE_URL")
    use_zone(settings)
    known_words(settings.rotary_words)
    front = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, redirect_slashes=False)
    front.state.settings = settings
    add_problem_handlers(front, _nobody)
    front.router.routes += plants_pages.router.routes
    read_after_recognition(front)
    return Plants(settings, create_plant, front, process(ending))


async def _nobody(_request: Request) -> None:
    """Recognise nobody: above all plants there are no people."""


def _compile_now(ends: Event) -> None:
    """Compile what the readings door needs, and then what pages need, so that nobody waits for the compiler."""
    try:
        try:
            columnar.compile_now()
        finally:
            health.compiling.clear()
        for _ in compile_each():
            if ends.is_set():
                return
    except Exception:  # a loop that is needed is compiled then, and its caller gets the error
        log.exception("loops could not be compiled at the start")


@asynccontextmanager
async def process(ending: Callable[[], None]) -> AsyncIterator[None]:
    """The work of a server process for all its plants: compiling, the proof, memory given back."""
    sys.setswitchinterval(TURN)
    ends = Event()
    health.compiling.set()
    compiling = asyncio.get_running_loop().run_in_executor(None, _compile_now, ends)
    giving_back = asyncio.get_running_loop().create_task(give_back_free_memory(), name="free memory")
    proving = proofs.begin_later(keep_for_good)
    gc.collect()
    keep_for_good()
    yield
    ending()
    ends.set()
    proving.cancel()
    giving_back.cancel()
    await compiling


def _pools(settings: Settings, connections: Connections, waits: Histogram) -> tuple[Database, Database, Database]:
    """The database of pages and programs, of machines at their doors, and of what works in the background.

    Requests that work for seconds may hold every connection of the first. Of the other two there are as many connections as
    threads that ask: where the database is unreachable, nobody waits half a minute for a connection of another caller.
    """
    url = settings.database_url or ""

    def database(name: str, pool_size: int, overflow: int | None = -1) -> Database:
        waited = waits.labels(name).observe
        return Database(url, pool_size=pool_size, overflow=overflow, connections=connections, waited=waited)

    return (
        database("pages", settings.pool_size, settings.pool_overflow),
        database("doors", settings.door_pool_size),
        database("background", 2),
    )


def create_plant(settings: Settings, prefix: str = "") -> Application:
    """Make the application of one plant. prefix: the path below which it is served, where there are several."""
    assert settings.database_url is not None
    connections = Connections(settings.database_url, settings.database_patience)
    waits = health.pool_waits()
    database, doors, background = _pools(settings, connections, waits)
    replica = replica_of(settings, database, waited=waits.labels("replica").observe)
    keys, directory = KeyRing(doors, caller_of_key), Directory(doors)
    writer = Writer(database, partial(report_touch_count, doors))
    live, jobs = Live(connections, still_granted), JobRunner(background, jobs_of(settings))
    report_worker, notifier = ReportWorker(background, settings), Notifier(background, settings, shift_words)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        connections.start()
        if replica is not None:
            replica.start()
        writer.start()
        live.start()
        jobs.start()
        report_worker.start()
        notifier.start()
        yield
        await live.stop()
        await jobs.stop()
        await report_worker.stop()
        await notifier.stop()
        await writer.stop()
        if replica is not None:
            replica.stop()
        background.close()
        doors.close()
        database.close()
        connections.stop()

    app = FastAPI(
        title="Inband",
        version="1",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        redirect_slashes=False,  # the framework's own redirect names the host that the request gave; see app.web.problems
    )
    app.state.settings = settings
    app.state.database = database
    app.state.doors = doors
    app.state.replica = replica
    app.state.key_ring = keys
    app.state.lookups = Lookups(doors)
    app.state.directory = directory
    app.state.writer = writer
    app.state.live = live
    app.state.report_worker = report_worker
    app.state.metrics = health.registry(database, settings.data_dir, replica, waits)
    app.state.wall = wall_pages.WallDoor()
    app.state.waiting = {
        "to_do": TO_DO_COUNT.scalar_subquery(),
    }
    environment()
    add_problem_handlers(app, recognise)
    app.mount("/static", assets())  # first, so that no file waits until hundreds of routes have been looked through
    for router in ROUTERS:
        app.router.routes += router.routes  # as they are: include_router would build each again, for every plant
    read_after_recognition(app)
    app.add_middleware(PageQueries, secure=settings.secure_cookies)
    if replica is not None:
        app.add_middleware(OwnChanges, replica=replica, secure=settings.secure_cookies)
    app.openapi = partial(document, app, readings.SCHEMAS, prefix or "/")  # type: ignore[method-assign]
    answers = UnderPrefix(app, prefix) if prefix else app
    small = GZipMiddleware(answers, minimum_size=1024, compresslevel=5, exclude_content_types=NOT_COMPRESSED)
    door = ReadingsDoor(SecurityHeaders(small), keys.lookup, directory, writer, doors)
    return Application(app, RequestLog(door, settings.slow_request))
