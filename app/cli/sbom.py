"""``inband sbom``: the bill of materials of this installation."""

import json
from datetime import UTC, datetime

import typer

from app.cli.base import cli


@cli.command()
def sbom() -> None:
    """Print the bill of materials of this installation: CycloneDX 1.6, as JSON. Needs no database and no network."""
    from app.db.binaries import BinariesError, binaries
    from app.views.licences.libraries import libraries
    from app.views.licences.sbom import bill

    try:
        postgres = ".".join(map(str, binaries().version))
    except BinariesError:  # a server of one's own
        postgres = None
    typer.echo(json.dumps(bill(libraries(), postgres, datetime.now(UTC)), indent=2))
