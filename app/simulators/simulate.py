"""``inband bridge simulate``: a simulated control, and its table for the bridge's configuration."""

import asyncio
import contextlib
from typing import Annotated

import typer

from app.cli.base import say
from app.cli.bridge import bridge
from app.errors import InbandError


@bridge.command("simulate")
def simulate(
    kind: Annotated[str, typer.Argument(help="Kind of control, such as haas.")],
    port: Annotated[int, typer.Option(envvar="INBAND_PORT", min=0, max=65535, help="Port; 0 for a free one.")] = 0,
    cycle: Annotated[float, typer.Option(envvar="INBAND_CYCLE", min=0.01, help="Seconds between two parts.")] = 5.0,
    inch: Annotated[bool, typer.Option("--inch", envvar="INBAND_INCH", help="The control works in inches.")] = False,
    at: Annotated[
        str | None,
        typer.Option("--at", envvar="INBAND_AT", help="Folder, or broker as host:port: kinds folder and mqtt."),
    ] = None,
    six_tools: Annotated[
        bool,
        typer.Option(
            "--six-tools",
            envvar="INBAND_SIX_TOOLS",
            help="Eight characteristics on six tools, one with a sister, one without a location.",
        ),
    ] = False,
) -> None:
    """Start a simulated control that makes and measures parts; its table for the configuration goes to standard output."""
    from app.core.ring import Unit
    from app.simulators.controls import NoPlace, simulator_named
    from app.simulators.controls import model as simulated
    from app.simulators.controls.model import Feature, Model, live
    from app.simulators.controls.toml_text import toml_of

    try:
        module = simulator_named(kind)
    except LookupError as error:
        raise InbandError(str(error)) from error
    if at is not None and not hasattr(module, "AT"):
        raise typer.BadParameter(f"A simulated control of kind {kind} needs no place.", param_hint="--at")

    async def work() -> None:
        features = getattr(module, "FEATURES", (Feature(),))
        if six_tools:
            features = simulated.six_tools(features[0])
        model = Model(features, unit=Unit.INCH if inch else Unit.MM, mail_wait=1.0)
        simulator = await (module.serve(model, port) if at is None else module.serve(model, port, at))
        typer.echo(toml_of(model.serial.lower(), simulator.table()))
        where = f" listens on port {simulator.port}" if simulator.port else " runs"
        say(f"A simulated control of kind {kind}{where}. End it with Ctrl-C.")
        try:
            await live(model, cycle)
        finally:
            await simulator.stop()

    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(work())
    except NoPlace as error:
        raise InbandError(str(error)) from error
