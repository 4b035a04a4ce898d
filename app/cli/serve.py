"""``inband serve``: the database, the migrations, the server."""

import errno
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from multiprocessing import parent_process
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import typer

from app import __version__, core, logs
from app.cli.base import (
    DatabaseUrl,
    DataDir,
    LogForm,
    LogLevel,
    cli,
    opened,
    reachable,
    remember_address,
    say,
    settings_from,
)
from app.cli.plants import migrate_all
from app.db.disk import watch
from app.errors import Compiling, InbandError

if TYPE_CHECKING:
    from starlette.types import ASGIApp

    from app.db.engine import Database
    from app.settings import Settings

log = logging.getLogger(__name__)

END_WITHIN = 5.0
"""Seconds that the application has for ending in order; then it is left as it is, and the database is stopped in order."""
LOADED_WITHIN = 3.0
"""Seconds in which a start has loaded what an earlier one has compiled."""

Host = Annotated[str | None, typer.Option(envvar="INBAND_HOST", help="Address to listen on.", show_default="127.0.0.1")]
Port = Annotated[int | None, typer.Option(envvar="INBAND_PORT", help="Port to listen on.", show_default="8000")]
Workers = Annotated[int | None, typer.Option(envvar="INBAND_WORKERS", help="Server processes.", show_default="1")]


@cli.command()
def serve(
    host: Host = None,
    port: Port = None,
    data_dir: DataDir = None,
    workers: Workers = None,
    database_url: DatabaseUrl = None,
    log_level: LogLevel = None,
    log_format: LogForm = None,
) -> None:
    """Run the server until Ctrl-C or SIGTERM."""
    settings = settings_from(
        host=host,
        port=port,
        data_dir=data_dir,
        workers=workers,
        database_url=database_url,
        log_level=log_level,
        log_format=log_format,
    )
    run(settings, prepare=invite_administrator)


def run(
    settings: "Settings",
    *,
    prepare: "Callable[[Database, Settings], None] | None" = None,
    beside: "Callable[[Settings], None] | None" = None,
) -> None:
    """Serve until asked to end. ``prepare`` runs when the database is migrated, ``beside`` in a thread once we answer."""
    logs.configure(settings.log_level, settings.log_format)
    signal.signal(signal.SIGTERM, _end)  # from the first moment on, so that the database is always ended in order
    from app.db.connections import in_schema
    from app.db.migrate import current
    from app.files.formats.rotary_words import known_words
    from app.plants.serving import settings_of
    from app.web.protocol import raise_file_limit

    known_words(settings.rotary_words)
    raise_file_limit()
    with _listen(settings) as listening, ExitStack() as stack:
        _keep_compiled(settings.data_dir)
        url = stack.enter_context(reachable(settings))
        listed = migrate_all(url, settings)
        database = stack.enter_context(opened(url, settings))
        os.environ |= {
            "INBAND_DATABASE_URL": database.dsn,  # for the workers, which make their own Settings
            "INBAND_DATA_DIR": str(settings.data_dir),
            "INBAND_HOST": settings.host,
            "INBAND_PORT": str(settings.port),
            "INBAND_WORKERS": str(settings.workers),
            "INBAND_LOG_LEVEL": settings.log_level,
            "INBAND_LOG_FORMAT": settings.log_format,
        }
        if prepare is not None and not (listed and current(url) is None):
            prepare(database, settings)
        for plant in listed:
            with opened(in_schema(url, plant.schema), settings) as of_plant:
                invite_administrator(of_plant, settings_of(plant, settings.model_copy(update={"database_url": url})))
        _log_start(database, settings)
        database.close()
        database.connections.stop()
        remember_address(settings)
        watch(settings.data_dir)
        if beside is not None:
            threading.Thread(target=_once_ready, args=(settings, beside), daemon=True).start()
        threading.Thread(target=_say_address, args=(settings,), daemon=True).start()
        _serve(settings, listening, stack.close)
    log.info("Inband has ended")
    _leave_threads()


def _keep_compiled(data_dir: Path) -> None:
    """Keep compiled loops in the data folder where nothing can be written beside the program: the next start needs them too.

    To be called before Numba is imported, which migrations do.
    """
    from app.db.embedded import EmbeddedServerError, make_data_dir

    if "NUMBA_CACHE_DIR" in os.environ or os.access(Path(core.__path__[0]), os.W_OK):
        return
    folder = data_dir / "compiled"
    with suppress(EmbeddedServerError, OSError):  # then each process compiles for itself
        make_data_dir(data_dir)
        folder.mkdir(mode=0o700, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


def _log_start(database: "Database", settings: "Settings") -> None:
    from sqlalchemy import text

    with database.begin() as session:
        version = session.scalar(text("SHOW server_version"))
    log.info(
        "Inband %s begins to listen on %s port %d (%s), %d worker(s), data folder %s, PostgreSQL %s %s",
        __version__,
        settings.host,
        settings.port,
        settings.address,
        settings.workers,
        settings.data_dir,
        version,
        f"at {database.connections.place}" if settings.database_url else "embedded there",
    )


class _Ending:
    """The end of a process whose application may not come to its own: anyone who is first ends the rest."""

    def __init__(self, finish: Callable[[], None]) -> None:
        self._finish = finish
        self._first = threading.Lock()

    def begin(self) -> None:
        """Give the application its time; call it when it begins to end."""
        log.info("Inband ends")
        watch = threading.Timer(END_WITHIN, self._give_up)
        watch.daemon = True
        watch.start()

    def done(self) -> None:
        """The application has ended. Does not come back if it has been given up by then."""
        if not self._first.acquire(blocking=False):
            threading.Event().wait()

    def _give_up(self) -> None:
        if self._first.acquire(blocking=False):
            log.warning("the server did not end within %g s; still at work: %s", END_WITHIN, ", ".join(_at_work()))
            self._finish()
            _leave()


def _at_work() -> list[str]:
    """Names of the threads that keep the process."""
    return [
        thread.name for thread in threading.enumerate() if thread is not threading.main_thread() and not thread.daemon
    ] or ["the main thread"]


def _leave_threads() -> None:
    """End the process although a thread works on, which would keep it for as long as that lasts: everything is closed."""
    for thread in threading.enumerate():
        if thread is not threading.main_thread() and not thread.daemon:
            thread.join(0.5)  # most are only about to end
            if thread.is_alive():
                log.warning("the server has ended; still at work and left behind: %s", ", ".join(_at_work()))
                _leave()


def _leave() -> None:
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)


def invite_administrator(database: "Database", settings: "Settings") -> None:
    """As long as nobody could set anything up, print a link by which one person becomes administrator, once."""
    from app.access import actions, queries

    with database.begin() as session:
        if queries.active_admins(session):
            return
        token = actions.create_invitation(session, role="admin", actor="inband serve")
    say("There is no administrator yet. The first person to open this link becomes one (it works once, for a week):")
    say(f"  {settings.address}/invitation/{token}", style="bold")


def _serve(settings: "Settings", listening: socket.socket, finish: Callable[[], None]) -> None:
    import uvicorn
    from uvicorn.config import STARTUP_FAILURE
    from uvicorn.supervisors import Multiprocess

    from app.web.protocol import ServerProtocol

    ending = _Ending(finish)
    config = uvicorn.Config(
        partial(_create_alone, ending) if settings.workers == 1 else "app.cli.serve:create_worker",
        factory=True,
        host=settings.host,
        port=settings.port,
        workers=settings.workers,
        loop="app.web.accepting:Loop",
        http=ServerProtocol,
        ws="none",
        access_log=False,
        log_config=None,  # ours: see app.logs
        log_level="warning",
        server_header=False,
        forwarded_allow_ips=settings.forwarded_allow_ips,
        timeout_graceful_shutdown=2,  # live pages keep their stream open for ever
        backlog=2048,
    )
    server = uvicorn.Server(config)
    if settings.workers > 1:
        workers = Multiprocess(config, [listening])
        workers.run()
        if any(process.exitcode == STARTUP_FAILURE for process in workers.processes):
            raise InbandError("The server did not start; see the reason above.")
        return
    try:
        server.run(sockets=[listening])
    except KeyboardInterrupt:  # uvicorn has ended in order and passes the signal on
        return
    except SystemExit as end:  # the same of SIGTERM, or the application has not started
        if end.code:
            raise
        return
    finally:
        ending.done()
    if not server.started:
        raise InbandError("The server did not start; see the reason above.")


def _create_alone(ending: _Ending) -> "ASGIApp":
    """The application of the only process."""
    from app.memory import reading_modules

    with reading_modules():
        from app.main import create_app

    return create_app(ending=ending.begin)


def create_worker() -> "ASGIApp":
    """The application in one of several processes; it ends when the parent, which keeps the database, is killed."""
    from app.memory import reading_modules

    with reading_modules():
        from app.main import create_app
        from app.settings import Settings

    settings = Settings()
    logs.configure(settings.log_level, settings.log_format)
    parent = parent_process()  # as it was when we were begun: by now it may be gone already
    assert parent is not None

    def watch() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
    return create_app(settings, ending=_Ending(lambda: None).begin)


def _listen(settings: "Settings") -> socket.socket:
    """Take the port before anything else is begun. Nobody is let in before the server says so: bound, not listening."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listening = socket.socket(family)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((settings.host, settings.port))
    except OSError as error:
        listening.close()
        where = f"{settings.host} port {settings.port}"
        if error.errno == errno.EADDRINUSE:
            raise InbandError(
                f"{where} is taken by another program, perhaps another Inband.",
                f"End that one, or choose another port: --port {settings.port + 1 if settings.port < 65535 else 8000}",
            ) from None
        raise InbandError(
            f"Cannot listen on {where}: {error.strerror}.", "Ports below 1024 are root's; see --host and --port."
        ) from None
    return listening


def _local_host(settings: "Settings") -> str:
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)  # noqa: S104 - compared only


def _say_address(settings: "Settings") -> None:
    """Print the address as soon as connections to it are accepted; and where it has to compile first, that, and when it is ready."""
    while True:
        with suppress(OSError), socket.create_connection((_local_host(settings), settings.port), timeout=2):
            break
        time.sleep(0.05)
    say(f"Inband: {settings.address}  (Ctrl-C ends it)")
    time.sleep(LOADED_WITHIN)
    if _readiness(settings) == Compiling.kind:
        say("Not ready yet: it compiles what decides readings, once after an installation or upgrade.")
        while _readiness(settings) == Compiling.kind:
            time.sleep(LOADED_WITHIN)  # each is a line in the log
        say("Ready.")


def _once_ready(settings: "Settings", beside: "Callable[[Settings], None]") -> None:
    while (missing := _readiness(settings)) != "":
        time.sleep(LOADED_WITHIN if missing == Compiling.kind else 0.1)
    beside(settings)


def _readiness(settings: "Settings") -> str | None:
    """Return the kind of problem that `/health/ready` names; empty if it is ready, None if it does not answer."""
    import httpx

    host = _local_host(settings)
    url = f"http://[{host}]" if ":" in host else f"http://{host}"
    try:
        answer = httpx.get(f"{url}:{settings.port}/health/ready", timeout=2)
        return "" if answer.is_success else str(answer.json()["type"]).rpartition(":")[2]
    except (httpx.HTTPError, ValueError, LookupError, TypeError):
        return None


def _end(_number: int, _frame: FrameType | None) -> None:
    raise SystemExit(0)
