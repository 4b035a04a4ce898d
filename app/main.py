"""The wiring and nothing else: `create_app` puts the house together."""

import asyncio
import gc
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from fastapi import APIRouter, FastAPI
from starlette.types import ASGIApp

from app.alarms import api as alarms
from app.alarms import pages as alarm_pages
from app.alignments import api as alignments
from app.alignments import pages as alignment_pages
from app.alignments import pictures_api as alignment_pictures
from app.audit import api as audit
from app.calibration import api as calibration
from app.calibration import pages as calibration_pages
from app.calibration.overdue import raise_overdue
from app.capability import api as capability
from app.capability import pages as capability_pages
from app.characteristics import api as characteristics
from app.characteristics import figures_api
from app.characteristics import pages as characteristic_pages
from app.control import api as control
from app.control import pages as control_pages
from app.control import rules_api, rules_pages, signals_api, signals_pages
from app.control.signals_actions import SignalRounds
from app.db.engine import Database
from app.forms import api as forms
from app.forms import pages as form_pages
from app.gauges import api as gauges
from app.gauges import pages as gauge_pages
from app.kinematics import api as kinematics
from app.kinematics import new_pages as new_run_pages
from app.kinematics import pages as kinematics_pages
from app.kinematics import protocol_api as kinematics_protocol
from app.machines import api as machines
from app.offsets import api as offsets
from app.offsets import chores as offset_chores
from app.offsets import edge_pages, edges_api, queue_pages, text_api, text_pages
from app.offsets import pages as offset_pages
from app.overview import api as overview
from app.overview import pages as overview_pages
from app.people import api as people
from app.people import keys_api
from app.people import pages as sign_in_pages
from app.people.keys import KeyRing
from app.plant import pages as plant_pages
from app.programs import api as programs
from app.proof import api as proof
from app.proof import pages as proof_pages
from app.proof import queries as proofs
from app.readings import actions as reading_chores
from app.readings import api as readings
from app.readings.by_hand import api as by_hand
from app.readings.door import Directory, ReadingsDoor
from app.readings.importing import pages as import_pages
from app.readings.quiet import compile_now
from app.readings.writer import Writer
from app.reports import actions as report_chores
from app.reports import api as reports
from app.reports import jobs_api as report_jobs
from app.reports import jobs_pages as report_job_pages
from app.reports import pages as report_pages
from app.reports import points_api as report_points
from app.reports.making import Reporter
from app.rounds import Chore, Rounds
from app.settings import Settings
from app.setup import pages as setup_pages
from app.statistics import api as statistics
from app.wear import actions as wear_chores
from app.wear import api as wear
from app.web import api_docs, events_api, health
from app.web.limits import BodyLimit
from app.web.live import Live
from app.web.openapi import document
from app.web.problems import add_problem_handlers
from app.web.security import SecurityHeaders
from app.web.templates import assets
from app.whatif import api as what_if
from app.whatif import pages as what_if_pages
from app.zeros import api as zeros
from app.zeros import pages as zero_pages

# Each part of the shop floor brings its JSON routes (api) and its pages.
ROUTERS: tuple[APIRouter, ...] = (
    machines.router,
    characteristics.router,
    figures_api.router,
    statistics.router,
    capability.router,
    overview.router,
    proof.router,
    wear.router,
    zeros.router,
    alignments.router,
    alignment_pictures.router,
    reports.router,
    report_jobs.router,
    report_points.router,
    control.router,
    rules_api.router,
    what_if.router,
    signals_api.router,
    readings.push,
    readings.router,
    by_hand.router,
    offsets.router,
    calibration.router,
    gauges.router,
    kinematics_protocol.router,
    kinematics.router,
    edges_api.router,
    forms.router,
    programs.router,
    text_api.router,
    alarms.router,
    events_api.router,
    people.router,
    keys_api.router,
    audit.router,
    health.router,
    api_docs.router,
    plant_pages.router,
    overview_pages.router,
    characteristic_pages.router,
    control_pages.router,
    rules_pages.router,
    what_if_pages.router,
    signals_pages.router,
    capability_pages.router,
    alarm_pages.router,
    queue_pages.router,
    text_pages.router,
    edge_pages.router,
    offset_pages.router,
    calibration_pages.router,
    gauge_pages.router,
    form_pages.router,
    alignment_pages.router,
    zero_pages.router,
    new_run_pages.router,
    kinematics_pages.router,
    sign_in_pages.router,
    setup_pages.router,
    import_pages.router,
    proof_pages.router,
    report_pages.router,
    report_job_pages.router,
)

# What is looked after once a minute; see app.rounds.
CHORES: tuple[Chore, ...] = (
    Chore("corrections expire", offset_chores.expire_corrections),
    Chore("tool lives are told", offset_chores.tell_tool_lives),
    Chore("wear is foretold, and hunting told", wear_chores.look_ahead),
    Chore("calibrations are overdue", raise_overdue),
    Chore("old reports are thrown away", report_chores.drop_old),
    Chore("signals of the rules are kept", SignalRounds().look),
    Chore("results of other measuring systems become readings", reading_chores.push_waiting),
)


def keep_for_good() -> None:
    """What has been made so far stays: the collector, for which everybody waits, need not walk it again.

    At the start, which halves the p99; and when the proof has brought in the compiler, where a full round would take a
    tenth of a second at best, and half a second while pages compute. So nothing is collected before: that is such a round.
    """
    gc.freeze()


def create_app(settings: Settings | None = None) -> ASGIApp:
    """Make the application for one server process. Without settings they come from the environment."""
    settings = settings or Settings()
    if settings.database_url is None:
        raise RuntimeError("no database: `inband serve` starts one, or set INBAND_DATABASE_URL")
    database = Database(settings.database_url, pool_size=settings.pool_size)
    # Readings are let in by connections of their own: requests that work for seconds may hold all the others. There are as
    # many as threads that look up: where the database is away, nobody waits half a minute for a connection of somebody else.
    letting_in = Database(settings.database_url, pool_size=4, overflow=-1)
    keys, directory = KeyRing(letting_in), Directory(letting_in)
    writer, live, rounds = Writer(database.dsn), Live(database.dsn), Rounds(database, CHORES)
    reporter = Reporter(database)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        writer.start()
        live.start()
        rounds.start()
        reporter.start()
        compiling = asyncio.get_running_loop().run_in_executor(None, compile_now)
        proving = proofs.begin_later(keep_for_good)
        gc.collect()
        keep_for_good()
        yield
        proving.cancel()
        await compiling
        await live.stop()
        await rounds.stop()
        await reporter.stop()
        await writer.stop()
        letting_in.close()
        database.close()

    app = FastAPI(title="Inband", version="1", lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)
    app.state.settings = settings
    app.state.database = database
    app.state.key_ring = keys
    app.state.directory = directory
    app.state.writer = writer
    app.state.live = live
    app.state.reporter = reporter
    app.state.metrics = health.registry(database)
    add_problem_handlers(app)
    app.add_middleware(BodyLimit)
    for router in ROUTERS:
        app.include_router(router)
    app.openapi = partial(document, app, readings.SCHEMAS)  # type: ignore[method-assign]
    app.mount("/static", assets())
    return ReadingsDoor(SecurityHeaders(app), keys.lookup, directory, writer, letting_in)
