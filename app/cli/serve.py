"""``inband serve``: the database, the migrations, the server."""

import errno
import os
import signal
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing import parent_process
from types import FrameType
from typing import Annotated

import httpx
import typer
import uvicorn
from starlette.types import ASGIApp
from uvicorn.config import STARTUP_FAILURE
from uvicorn.supervisors import Multiprocess

from app.cli.base import DatabaseUrl, DataDir, cli, migrated, say, settings_from
from app.db.engine import Database
from app.errors import InbandError
from app.people import actions, queries
from app.settings import Settings
from app.web.protocol import OneWriteProtocol

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
) -> None:
    """Run the server until Ctrl-C or SIGTERM."""
    settings = settings_from(host=host, port=port, data_dir=data_dir, workers=workers, database_url=database_url)
    run(settings, prepare=invite_administrator)


def run(
    settings: Settings,
    *,
    prepare: Callable[[Database, Settings], None] | None = None,
    beside: Callable[[Settings], None] | None = None,
) -> None:
    """Serve until told to end. ``prepare`` runs when the database is migrated, ``beside`` in a thread once we answer."""
    signal.signal(signal.SIGTERM, _end)  # from the first moment on, so that the database is always ended in order
    listening = _listen(settings)
    with listening, migrated(settings) as database:
        os.environ |= {
            "INBAND_DATABASE_URL": database.dsn,  # for the workers, which make their own Settings
            "INBAND_DATA_DIR": str(settings.data_dir),
            "INBAND_HOST": settings.host,
            "INBAND_PORT": str(settings.port),
            "INBAND_WORKERS": str(settings.workers),
        }
        if prepare is not None:
            prepare(database, settings)
        database.close()
        if beside is not None:
            threading.Thread(target=_once_ready, args=(settings, beside), daemon=True).start()
        say(f"Inband: {settings.address}  (Ctrl-C ends it)")
        _serve(settings, listening)


def invite_administrator(database: Database, settings: Settings) -> None:
    """As long as nobody could set anything up, print a link by which one person becomes administrator, once."""
    with database.begin() as session:
        if queries.active_admins(session):
            return
        token = actions.create_invitation(session, role="admin", actor="inband serve")
    say("There is no administrator yet. Whoever opens this link first becomes one (it works once, for a week):")
    say(f"  {settings.address}/invitation/{token}", style="bold")


def _serve(settings: Settings, listening: socket.socket) -> None:
    config = uvicorn.Config(
        "app.main:create_app" if settings.workers == 1 else "app.cli.serve:create_worker",
        factory=True,
        host=settings.host,
        port=settings.port,
        workers=settings.workers,
        loop="uvloop",
        http=OneWriteProtocol,
        ws="none",
        access_log=False,
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
            raise InbandError("The server did not start; the reason stands above.")
        return
    try:
        server.run(sockets=[listening])
    except KeyboardInterrupt:  # uvicorn has ended in order and passes the signal on
        return
    if not server.started:
        raise InbandError("The server did not start; the reason stands above.")


def create_worker() -> ASGIApp:
    """The application in one of several processes; it ends when the parent, which keeps the database, is killed."""
    from app.main import create_app

    parent = parent_process()  # as it was when we were begun: by now it may be gone already
    assert parent is not None

    def watch() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, daemon=True).start()
    return create_app()


def _listen(settings: Settings) -> socket.socket:
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


def _once_ready(settings: Settings, beside: Callable[[Settings], None]) -> None:
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)  # noqa: S104 - compared only
    url = f"http://[{host}]" if ":" in host else f"http://{host}"
    while True:
        try:
            if httpx.get(f"{url}:{settings.port}/health/ready", timeout=2).status_code == httpx.codes.OK:
                break
        except httpx.HTTPError:
            pass
        time.sleep(0.1)
    beside(settings)


def _end(_number: int, _frame: FrameType | None) -> None:
    raise SystemExit(0)
