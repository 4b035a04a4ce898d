"""``inband bridge …``: the program beside machines that cannot speak REST."""

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app import logs
from app.bridge.loops import ended_by_signals, run_selecting
from app.cli.base import LogForm, LogLevel, cli, say
from app.errors import InbandError

if TYPE_CHECKING:
    from app.bridge.configuration import Configuration
    from app.bridge.store import Store

bridge = typer.Typer(help="Connect machines that cannot speak REST.", invoke_without_command=True)
cli.add_typer(bridge, name="bridge")


def _named_before(context: typer.Context, config: Path) -> Path:
    """The configuration of a command: that named behind it, else that named before it, as in ``inband bridge --config a.toml check``."""

    def is_named(where: Any) -> bool:
        source = where.get_parameter_source("config")
        return source is not None and source.name == "COMMANDLINE"

    if context.parent is None or is_named(context) or not is_named(context.parent):
        return config
    return Path(context.parent.params["config"])


ConfigFile = Annotated[
    Path,
    typer.Option(
        "--config",
        envvar="INBAND_BRIDGE_CONFIG",
        help="The configuration, a TOML file.",
        callback=_named_before,
    ),
]
MachineName = Annotated[str, typer.Argument(help="The key of the machine, as in the configuration.")]
PLANT = Path("plant.toml")


def _configuration(file: Path) -> "Configuration":
    from app.bridge.configuration import ConfigurationError, read_configuration

    try:
        return read_configuration(file)
    except ConfigurationError as error:
        raise InbandError(
            "The configuration cannot be used:\n" + "\n".join(f"- {problem}" for problem in error.problems),
            f"Correct {file}, and look with “inband bridge check --config {file}”.",
        ) from error


def _with_store(
    file: Path, work: "Callable[[Configuration, Store], Coroutine[Any, Any, None]]", *, alone: bool = False
) -> None:
    """Do something with the configuration and its store. alone: no other program may work with the controls meanwhile."""
    from app.bridge.program import store_of
    from app.bridge.store_lock import StoreError

    configuration = _configuration(file)
    try:
        store = store_of(configuration)
        try:
            with store.alone() if alone else contextlib.nullcontext():
                run_selecting(work(configuration, store))
        finally:
            store.close()
    except StoreError as error:
        raise InbandError(str(error)) from error


@bridge.callback()
def run_bridge(
    context: typer.Context, config: ConfigFile = PLANT, log_level: LogLevel = None, log_format: LogForm = None
) -> None:
    """Run the bridge: fetch readings from the machines, send them to the server, bring corrections back."""
    if context.invoked_subcommand is not None:
        return
    from app.bridge import program

    logs.configure(log_level or "info", log_format or "text")

    async def work(configuration: "Configuration", store: "Store") -> None:
        running = asyncio.create_task(program.run(configuration, store))
        with contextlib.suppress(asyncio.CancelledError), ended_by_signals(running):
            await running

    _with_store(config, work, alone=True)


@bridge.command("check")
def check_bridge(config: ConfigFile = PLANT) -> None:
    """Say what is wrong with the configuration, and what the server and each machine answer.

    Where a bridge writes, the check writes too: what is there already, or a file that it takes away again. Nothing is changed.
    """
    from app.bridge.checking import check

    findings = run_selecting(check(_configuration(config)))
    for finding in findings:
        say(str(finding), style=None if finding.good else "bold red")
    if not all(finding.good for finding in findings):
        raise typer.Exit(1)


@bridge.command("print-macros")
def print_macros(
    first_register: Annotated[
        int, typer.Option(envvar="INBAND_FIRST_REGISTER", help="First of the variables that they keep.")
    ] = 700,
    first_program: Annotated[
        int, typer.Option(envvar="INBAND_FIRST_PROGRAM", help="Number of the first of the three.")
    ] = 9825,
) -> None:
    """Write the user macros with which a Fanuc prints readings for kind dprnt, to standard output."""
    from app.core.programs.dprnt import dprnt_programs

    try:
        typer.echo(dprnt_programs(first_register, first_program), nl=False)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


@bridge.command("preview")
def preview(
    machine: MachineName,
    file: Annotated[
        Path, typer.Argument(help="A file as the measuring machine writes it.", exists=True, dir_okay=False)
    ],
    config: ConfigFile = PLANT,
) -> None:
    """Say what each line of a file would become. Nothing is sent, moved or stored. For machines of kind folder.

    The server is asked for the targets, if it answers: sizes that no part can have are named.
    """
    from app.bridge.file_content import files_of, read_content
    from app.bridge.file_rows import reasons
    from app.bridge.plausible import Unasked, far_off, targets_of
    from app.files.formats.delimited import Unusable

    configuration = _configuration(config)
    chosen = next(each for each in configuration.machines if each.key == _known(configuration, machine))
    if chosen.kind != "folder":
        raise InbandError(f"{machine} is of kind {chosen.kind}; a preview is there for kind folder.")
    try:
        content = read_content(chosen, files_of(file))
    except (OSError, Unusable) as error:
        raise InbandError(f"{file} cannot be read: {error}.") from error
    for reason in reasons(content.faults):
        say(f"✗ {reason}", style="bold red")
    for entry in content.entries:
        words = "\t".join(f"{name}={value}" for name, value in entry.body.items())
        typer.echo(f"line {entry.line}\t{entry.name}\t{words}")
    for remark in content.remarks:
        say(remark)
    if content.skipped:
        say(f"{content.skipped} readings are passed over.")
    if content.faults:
        say("The file would go to the folder of failed files; nothing of it would be stored.")
        raise typer.Exit(1)
    say(f"{len(content.entries)} readings.")
    try:
        keys = [entry.body["characteristic"] for entry in content.entries]
        doubts = far_off(content.entries, asyncio.run(targets_of(configuration, chosen, keys)))
    except Unasked as error:
        say(f"The sizes are not compared with their targets, the server does not say them: {error}", style="yellow")
        return
    for doubt in doubts:
        say(f"✗ {doubt}", style="bold red")
    if doubts:
        raise typer.Exit(1)


@bridge.command("hold")
def hold(
    machine: Annotated[str | None, typer.Argument(help="Only this machine; all if left out.")] = None,
    config: ConfigFile = PLANT,
) -> None:
    """Hold all corrections back, within seconds; readings go on. A bridge that runs takes notice by itself."""

    async def work(configuration: "Configuration", store: "Store") -> None:
        await store.note(
            _known(configuration, machine), "hold_all" if machine is None else "hold", "by the command line"
        )

    _with_store(config, work)
    say(f"Corrections of {machine or 'all machines'} are on hold. Release them with “inband bridge resume”.")


@bridge.command("resume")
def resume(
    machine: Annotated[str | None, typer.Argument(help="Only this machine; all if left out.")] = None,
    config: ConfigFile = PLANT,
) -> None:
    """Let corrections go on that were held back."""

    async def work(configuration: "Configuration", store: "Store") -> None:
        await store.note(_known(configuration, machine), "hold_all" if machine is None else "hold", None)

    _with_store(config, work)
    say(f"Corrections of {machine or 'all machines'} go on.")


@bridge.command("accept-counters")
def accept_counters(machine: MachineName, config: ConfigFile = PLANT) -> None:
    """Begin again with the counters that the control has now, after a person has looked why they went back.

    Readings that the bridge has stored stay stored; those that come get keys of their own.
    """

    async def work(configuration: "Configuration", store: "Store") -> None:
        key = _known(configuration, machine)
        chosen = next(each for each in configuration.machines if each.key == key)
        if chosen.kind == "heidenhain" or getattr(chosen.settings, "file", None) is not None:
            raise InbandError(
                f"{machine} prints into a file, which would be read again from its beginning under new keys: every reading in"
                " it would come a second time. Nothing was changed. What the control counts twice is in the quarantine."
            )
        await store.accept_counters(key)

    _with_store(config, work)
    say(f"The bridge takes the counters of {machine} as they are. A bridge that runs connects again within seconds.")


@bridge.command("quarantine")
def quarantine(
    machine: MachineName,
    send: Annotated[bool, typer.Option("--send", help="Send them again: the cause is fixed.")] = False,
    drop: Annotated[bool, typer.Option("--drop", help="Delete them for ever.")] = False,
    key: Annotated[str | None, typer.Option(help="Only the reading with this key.")] = None,
    config: ConfigFile = PLANT,
) -> None:
    """List the readings that the server has refused, with the reason; send them again, or drop them."""
    from app.bridge.store import NUMBER

    if send and drop:
        raise typer.BadParameter("Choose one of --send and --drop.")

    async def work(configuration: "Configuration", store: "Store") -> None:
        named = _known(configuration, machine)
        if send or drop:
            names = next(each.characteristics for each in configuration.machines if each.key == named)
            number = await store.release(named, key, drop=drop, named=names)
            say(f"{number} readings {'dropped' if drop else 'wait to be sent again'}.")
            return
        held = await store.quarantine(named, 1000)
        if not held:
            say(f"The quarantine of {named} is empty.")
            return
        rows: list[tuple[str, ...]] = [("KEY", "CAME AT", "CHARACTERISTIC", "MEASURED", "REASON")]
        for each in held:
            at = datetime.fromtimestamp(each.at).astimezone().isoformat(timespec="seconds")
            name, size = each.body.get("characteristic") or each.body.get(NUMBER), each.body.get("measured")
            rows.append((each.key, at, *("-" if cell is None else str(cell) for cell in (name, size)), each.reason))
        widths = [max(map(len, column)) for column in list(zip(*rows, strict=True))[:-1]]
        for row in rows:
            typer.echo("\t".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[-1]]))

    _with_store(config, work)


@bridge.command("certificate")
def certificate(
    folder: Annotated[
        Path, typer.Option(envvar="INBAND_FOLDER", help="Where the files go: beside the configuration.")
    ] = Path(),
    host: Annotated[
        str | None, typer.Option(envvar="INBAND_HOST", help="Name of the machine with the bridge; its own if left out.")
    ] = None,
) -> None:
    """Make the certificate and the key with which the bridge shows itself to OPC UA controls."""
    from socket import gethostname

    from app.bridge.links import LIBRARIES

    try:
        from app.bridge.certificates import write_pair
    except ModuleNotFoundError as error:
        raise InbandError(f"{error.name} is not installed.", f"{LIBRARIES}.") from error
    try:
        public, key, uri = write_pair(folder, host or gethostname())
    except FileExistsError as error:
        raise InbandError(
            f"{error} is there already.", "Move it away first; controls have to trust a new certificate again."
        ) from error
    except OSError as error:
        raise InbandError(f"{folder} cannot be written: {error.strerror}.") from error
    say(f"Made {public} (for the controls) and {key} (keep it secret), URI {uri}.")
    say(f'Into each [machine.KEY.opcua]: certificate = "{public.name}" and key = "{key.name}".')
    say(
        "Then run “inband bridge check” once: the control refuses the certificate, and keeps it among the rejected ones."
    )
    say(
        "At the panel: Start-up, Network, OPC UA, certificates: choose “Inband bridge”, trust it, and run the check again."
    )
    say(f"Or carry {public.name} to the control on a USB stick and import it there as a trusted client.")


@bridge.command("touch-test")
def touch_test(
    machine: MachineName,
    tool_memory: Annotated[int, typer.Argument(help="Tool memory R10 of Inband.")],
    amount: Annotated[
        float, typer.Option(envvar="INBAND_AMOUNT", min=0.001, max=0.05, help="Change of the offset, mm.")
    ] = 0.010,
    config: ConfigFile = PLANT,
) -> None:
    """Prove the mapping of one tool location: change the offset a little, look at the control, take it back.

    Corrections reach a location only after this. Stop the bridge, and let nothing run on the machine.
    """
    from app.bridge.proving import run as run_test

    async def work(configuration: "Configuration", store: "Store") -> None:
        chosen = next(each for each in configuration.machines if each.key == _known(configuration, machine))
        if not await run_test(chosen, tool_memory, amount, store, say, typer.confirm):
            raise typer.Exit(1)

    _with_store(config, work, alone=True)


def _known(configuration: "Configuration", machine: str | None) -> str:
    """The key of a machine that the configuration has; empty for all of them."""
    if machine is None:
        return ""
    keys = [each.key for each in configuration.machines]
    if machine not in keys:
        raise InbandError(f"The configuration has no machine {machine!r}; it has {', '.join(keys)}.")
    return machine
