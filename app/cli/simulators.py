"""The commands of the distribution inband-simulators. Where it is not installed, they say how to get it."""

from importlib import import_module
from importlib.util import find_spec

import typer

from app import __version__
from app.cli.base import SERVER, cli
from app.cli.bridge import bridge
from app.errors import InbandError


def say_how_to_get(group: typer.Typer, name: str, command: str, what: str) -> None:
    """Add a command that ends with where to get it, whatever options it was given."""

    @group.command(
        name,
        help=f"{what}: needs inband-simulators, which is not installed.",
        add_help_option=False,
        context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
    )
    def missing() -> None:
        raise InbandError(
            f"`{command}` belongs to the distribution inband-simulators, which is not installed.",
            f"Install inband_simulators-{__version__}-py3-none-any.whl, which is made beside Inband's own wheel, into the same "
            "environment: pip install --no-deps FILE",
        )


THERE = find_spec("app.simulators") is not None
if THERE:
    import_module("app.simulators.simulate")
else:
    say_how_to_get(bridge, "simulate", "inband bridge simulate", "A simulated control")
if THERE and SERVER:
    import_module("app.simulators.demonstrate")
elif SERVER:
    say_how_to_get(cli, "demo", "inband demo", "The demonstration plant")
