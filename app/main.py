"""The wiring and nothing else: `create_app` puts the house together."""

import asyncio
import gc
import logging
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from threading import Event

from fastapi import APIRouter, FastAPI, Request
from prometheus_client import Histogram
from starlette.middleware.gzip import GZipMiddleware

from app.access import api as people
from app.access import events_api, keys_api, screens_api
from app.access import pages as sign_in_pages
from app.access.audit import api as audit
from app.access.bodies import read_after_recognition
from app.access.deps import recognise
from app.access.keys import KeyRing
from app.access.queries import still_granted
from app.access.recognition import Lookups
from app.core.compile_now import compile_each
from app.db.connections import Connections
from app.db.engine import Database
from app.db.replica import replica_of
from app.geometry.alignment import api as alignments
from app.geometry.alignment import pages as alignment_pages
from app.geometry.alignment import pictures_api as alignment_pictures
from app.geometry.geometric_form import api as geometric_form
from app.geometry.geometric_form import pages as form_pages
from app.geometry.rotary_axes import api as rotary_axes
from app.geometry.rotary_axes import new_pages as new_run_pages
from app.geometry.rotary_axes import pages as rotary_axes_pages
from app.geometry.rotary_axes import plan_api, plan_pages
from app.geometry.rotary_axes import protocol_api as rotary_axes_protocol
from app.geometry.work_zero import api as work_zero
from app.geometry.work_zero import pages as work_zero_pages
from app.jobs.actions import PeriodicJob
from app.jobs.runner import JobRunner
from app.language.times import use_zone
from app.loop.alarm_response import api as alarms
from app.loop.alarm_response import pages as alarm_pages
from app.loop.calibration import api as calibration
from app.loop.calibration import jobs
from app.loop.calibration import pages as calibration_pages
from app.loop.characteristics import api as characteristics
from app.loop.connections import api as connections_api
from app.loop.connections import jobs as connection_jobs
from app.loop.connections import pages as connection_pages
from app.loop.connections.touch_tests import api as touch_tests_api
from app.loop.connections.touch_tests import pages as touch_test_pages
from app.loop.control_plan import api as control_plan
from app.loop.control_plan import jobs as control_plan_jobs
from app.loop.control_plan import pages as control_plan_pages
from app.loop.expansion import api as expansion
from app.loop.faults import api as faults
from app.loop.machines import api as machines
from app.loop.machines import keys_api as machine_keys
from app.loop.machines.keys import caller_of_key
from app.loop.notes import api as notes
from app.loop.notes import pages as note_pages
from app.loop.notifications import api as notifications
from app.loop.notifications.notifier import Notifier
from app.loop.present_context import actions as present_context
from app.loop.present_context import api as present_context_api
from app.loop.programs import api as programs
from app.loop.quarantine import api as quarantine
from app.loop.quarantine import pages as quarantine_pages
from app.loop.reactions import api as reactions
from app.loop.reactions import pages as reaction_pages
from app.loop.readings import api as readings
from app.loop.readings import results_actions, table_api
from app.loop.readings.aqdef import api as aqdef_api
from app.loop.readings.by_hand import api as by_hand
from app.loop.readings.door import Directory, ReadingsDoor
from app.loop.readings.importing import pages as import_pages
from app.loop.readings.writer import columnar
from app.loop.readings.writer.group_commit import Writer
from app.loop.summaries import api as statistics
from app.loop.tools import api as tools
from app.loop.tools import edge_pages, edges_api, text_api, text_pages
from app.loop.tools import jobs as tool_jobs
from app.loop.tools import pages as tool_pages
from app.loop.tools.untaken import Watch
from app.memory import give_back_free_memory, keep_few_arenas
from app.plants import pages as plants_pages
from app.plants.prefix import UnderPrefix
from app.plants.serving import Application, Plants
from app.quality.capability import actions as capability_actions
from app.quality.capability import api as capability
from app.quality.control_charts import api as control
from app.quality.control_charts import (
    counts_api,
    counts_pages,
    rules_api,
    rules_pages,
    signals_actions,
    signals_api,
    signals_pages,
)
from app.quality.control_charts import pages as control_pages
from app.quality.gauge_studies import api as gauge_studies
from app.quality.gauge_studies import pages as gauge_pages
from app.quality.ledger import api as ledger
from app.quality.ledger import pages as ledger_pages
from app.quality.proof import api as proof
from app.quality.proof import pages as proof_pages
from app.quality.proof import queries as proofs
from app.quality.sampling import api as sampling
from app.quality.sampling import pages as sampling_pages
from app.quality.temperature import api as temperature
from app.quality.temperature import pages as temperature_pages
from app.quality.trial import api as trial
from app.quality.trial import pages as trial_pages
from app.quality.wear import actions as wear_actions
from app.quality.wear import api as wear
from app.quality.what_if import api as what_if
from app.quality.what_if import pages as what_if_pages
from app.settings import Settings
from app.views.alarm_load import api as alarm_load
from app.views.alarm_load import pages as alarm_load_pages
from app.views.approvals import pages as queue_pages
from app.views.characteristic import capability_pages, figures_api, six_pack
from app.views.characteristic import pages as characteristic_pages
from app.views.compare import api as compare
from app.views.compare import pages as compare_pages
from app.views.help import pages as help_pages
from app.views.licences import pages as licence_pages
from app.views.overview import api as overview
from app.views.overview import pages as overview_pages
from app.views.plant import machine_pages, trying_pages
from app.views.plant import pages as plant_pages
from app.views.reports import actions as report_actions
from app.views.reports import api as reports
from app.views.reports import jobs_api as report_jobs
from app.views.reports import jobs_pages as report_job_pages
from app.views.reports import pages as report_pages
from app.views.reports import points_api as report_points
from app.views.reports.worker import ReportWorker
from app.views.search import api as search
from app.views.search import pages as search_pages
from app.views.search import readings_api as reading_list
from app.views.set_up import pages as setup_pages
from app.views.shift import api as shift
from app.views.shift import pages as shift_pages
from app.views.shift.mail import shift_words
from app.views.station import pages as station_pages
from app.views.to_do import pages as to_do_pages
from app.views.to_do.queries import COUNT as TO_DO_COUNT
from app.views.wall import pages as wall_pages
from app.web import api_docs, health
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

# Each part of the shop floor brings its JSON routes (api) and its pages.
ROUTERS: tuple[APIRouter, ...] = (
    machines.router,
    faults.router,
    connections_api.router,
    touch_tests_api.router,
    characteristics.router,
    expansion.router,
    figures_api.router,
    statistics.router,
    capability.router,
    compare.router,
    overview.router,
    shift.router,
    search.router,
    proof.router,
    wear.router,
    work_zero.router,
    alignments.router,
    alignment_pictures.router,
    reports.router,
    report_jobs.router,
    report_points.router,
    control.router,
    counts_api.router,
    rules_api.router,
    what_if.router,
    ledger.router,
    trial.router,
    sampling.router,
    temperature.router,
    signals_api.router,
    readings.push,
    reading_list.router,
    aqdef_api.router,
    table_api.router,
    readings.router,
    by_hand.router,
    tools.router,
    calibration.router,
    gauge_studies.router,
    rotary_axes_protocol.router,
    plan_api.router,
    rotary_axes.router,
    edges_api.router,
    geometric_form.router,
    programs.router,
    text_api.router,
    alarms.router,
    alarm_load.router,
    reactions.router,
    quarantine.router,
    control_plan.router,
    present_context_api.router,
    notes.router,
    notifications.router,
    events_api.router,
    people.router,
    machine_keys.router,
    keys_api.router,
    screens_api.router,
    audit.router,
    health.router,
    api_docs.router,
    machine_pages.router,
    connection_pages.router,
    touch_test_pages.router,
    plant_pages.router,
    trying_pages.router,
    station_pages.router,
    search_pages.router,
    to_do_pages.router,
    wall_pages.router,
    compare_pages.router,
    overview_pages.router,
    shift_pages.router,
    characteristic_pages.router,
    control_pages.router,
    counts_pages.router,
    rules_pages.router,
    what_if_pages.router,
    ledger_pages.router,
    trial_pages.router,
    sampling_pages.router,
    temperature_pages.router,
    signals_pages.router,
    capability_pages.router,
    six_pack.router,
    alarm_load_pages.router,  # before the pages of alarms by their number
    reaction_pages.router,  # /alarms/causes is no number of an alarm
    alarm_pages.router,
    quarantine_pages.router,
    control_plan_pages.router,
    note_pages.router,
    queue_pages.router,
    text_pages.router,
    edge_pages.router,
    tool_pages.router,
    calibration_pages.router,
    gauge_pages.router,
    form_pages.router,
    alignment_pages.router,
    work_zero_pages.router,
    new_run_pages.router,
    plan_pages.router,
    rotary_axes_pages.router,
    sign_in_pages.router,
    setup_pages.router,
    import_pages.router,
    proof_pages.router,
    help_pages.router,
    licence_pages.router,
    report_pages.router,
    report_job_pages.router,
)

# What is done once a minute; see app.jobs.
JOBS: tuple[PeriodicJob, ...] = (
    *tool_jobs.JOBS,
    wear_actions.JOB,
    jobs.JOB,
    present_context.JOB,  # before what looks for context that is missing
    control_plan_jobs.JOB,
    report_actions.JOB,
    signals_actions.JOB,
    capability_actions.JOB,
    results_actions.JOB,
)


def jobs_of(settings: Settings) -> tuple[PeriodicJob, ...]:
    """All of them, as the settings have it."""
    untaken = Watch(settings.corrections_taken_within, settings.corrections_not_taken_most)
    return *JOBS, connection_jobs.job(settings.bridge_silent_after), untaken.job()


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
        columnar.compile_now()
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
    threads that ask: where the database is unreachable, nobody waits half a minute for a connection of somebody else.
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
    writer, live, jobs = Writer(database), Live(connections, still_granted), JobRunner(background, jobs_of(settings))
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
