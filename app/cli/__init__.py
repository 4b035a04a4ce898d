"""The command line. What programs may read goes to standard output, what people read to standard error.

Exit status: 0 done, 1 failed, 2 wrong use. A part of the house adds its commands in a module of its own::

    from app.cli.base import cli

    @cli.command()
    def replay(...) -> None: ...

and names that module in ``PARTS``. The distribution inband-bridge carries the last two alone.
"""

import sys
from importlib import import_module
from importlib.util import find_spec

from app.cli.base import SERVER, cli, explain, say

PARTS = (
    "app.cli.serve",
    "app.cli.plants",
    "app.cli.database",
    "app.cli.backup",
    "app.cli.people",
    "app.cli.data",
    "app.cli.reports",
    "app.cli.replay",
    "app.cli.programs",
    "app.cli.proof",
    "app.cli.sbom",
    "app.cli.bridge",
    "app.cli.simulators",
)


def main() -> None:
    """Run the command; errors that people can do something about are said in words, not as a stack trace."""
    for part in PARTS:
        if SERVER or find_spec(part):
            import_module(part)
    try:
        cli(prog_name="inband")
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # `inband export | head`
        sys.stderr.close()
        sys.exit(1)
    except Exception as error:
        words, status = explain(error)
        if not words:
            raise
        say(words, style="bold red")
        sys.exit(status)
