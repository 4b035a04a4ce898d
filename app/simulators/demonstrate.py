"""``inband demo``: the server with the demonstration plant beside it."""

import logging
import os
import threading
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.base import DatabaseUrl, DataDir, LogForm, LogLevel, cli, say, settings_from
from app.cli.serve import Host, Port, run
from app.language.i18n import _

if TYPE_CHECKING:
    from app.db.engine import Database
    from app.settings import Settings
    from app.simulators.demo.running import Line

log = logging.getLogger(__name__)


@cli.command()
def demo(
    host: Host = None,
    port: Port = None,
    data_dir: DataDir = None,
    database_url: DatabaseUrl = None,
    seed: Annotated[
        int, typer.Option(envvar="INBAND_SEED", help="The same seed gives the same wear, scatter and mishaps.")
    ] = 1,
    speed: Annotated[
        float, typer.Option(envvar="INBAND_SPEED", min=1, max=10_000, help="How many times faster than life.")
    ] = 60,
    past: Annotated[
        float | None,
        typer.Option(
            envvar="INBAND_PAST",
            min=0.1,
            max=120,
            help="Days of past at the first start, one shift a day: 42 for six weeks. Else some hours.",
        ),
    ] = None,
    bridge: Annotated[
        bool,
        typer.Option("--bridge", envvar="INBAND_BRIDGE", help="One more machine: a simulated control, and a bridge."),
    ] = False,
    log_level: LogLevel = None,
    log_format: LogForm = None,
) -> None:
    """Run the server with a simulated plant: three lathes and a milling machine that call its public API."""
    from app.simulators.demo import people

    os.environ.setdefault("INBAND_WEBHOOK_NETWORKS", "127.0.0.1/32")  # its andon listens on this computer
    os.environ.setdefault("INBAND_PART_COST", "18")  # the ledger counts in money
    settings = settings_from(
        host=host, port=port, data_dir=data_dir, database_url=database_url, log_level=log_level, log_format=log_format
    )
    plant_key: list[str] = []

    def prepare(database: "Database", settings: "Settings") -> None:
        passwords = people.sign_ins(database, settings)
        plant_key.append(people.plant_key(database))
        say(_("Sign in as one of these (kept for the next start in {file}):").format(file=people.file_of(settings)))
        for name in people.PEOPLE:
            say(f"  {name:<9} " + passwords.get(name, _("(the password you have chosen)")), style="bold")
        say(_("Wall screen, without signing in: {link}").format(link=people.wall_link(database, settings)))

    def beside(settings: "Settings") -> None:
        start(settings, plant_key[0], seed, speed, past)
        if bridge:
            from app.simulators.demo import bridging

            url = f"http://{_here(settings.host)}:{settings.port}"
            bridging.start(url, plant_key[0], speed, settings.data_dir / "demo-bridge")

    run(settings, prepare=prepare, beside=beside)


def start(settings: "Settings", key: str, seed: int, speed: float, past: float | None = None) -> None:
    """Set the plant up and let every machine run in a thread of its own until the server's process ends."""
    from app.simulators.demo.installing import lines

    ending = threading.Event()
    simulated = lines(f"http://{_here(settings.host)}:{settings.port}", key, seed, ending)
    if past is not None and all(line.has_history() for line in simulated):
        say(_("The plant has a past already and goes on from there: --past is for a folder of its own (--data-dir)."))
    elif past is not None:
        say(_("The plant is starting: it pushes {days:g} days of the past, then goes on live.").format(days=past))
    else:
        say(_("The plant is starting: it pushes some hours of the past, then goes on live."))
    for line in simulated:
        threading.Thread(target=_run, args=(line, speed, past), name=f"demo {line.key}", daemon=True).start()


def _run(line: "Line", speed: float, past: float | None) -> None:
    from app.simulators.demo.installing import run_line
    from inband_client import ProblemError, Stopped

    try:
        run_line(line, speed, past)
    except Stopped:
        pass
    except ProblemError as refusal:
        say(_("The simulated machine {key} has ended: {why}").format(key=line.key, why=refusal), style="bold red")
    except Exception:
        log.exception("the simulated machine %s has ended", line.key)


def _here(host: str) -> str:
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # noqa: S104 - compared only
    return f"[{host}]" if ":" in host else host
