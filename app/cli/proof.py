"""``inband proof``: published examples against what this program computes."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.base import cli, people, say
from app.errors import InbandError
from app.language.i18n import _

if TYPE_CHECKING:
    from app.quality.proof.cases import Case
    from app.quality.proof.queries import Proof


@cli.command()
def proof(
    examples: Annotated[
        Path | None,
        typer.Option(
            envvar="INBAND_EXAMPLES",
            help="Examples of your own, written as those in app/quality/proof/cases.",
            show_default="the published ones",
            exists=True,
            dir_okay=False,
            readable=True,
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", envvar="INBAND_JSON", help="Print everything as JSON, as the API does.")
    ] = False,
) -> None:
    """Run published examples through the engine and compare. Exits with 1 when one does not come out. Needs no database."""
    from app.quality.proof.cases import cases
    from app.quality.proof.queries import run
    from app.quality.proof.schemas import ProofOut

    outcome = run(cases() if examples is None else _read(examples))
    if as_json:
        typer.echo(ProofOut.of(outcome).model_dump_json(indent=2))
    else:
        _tell(outcome)
    if not outcome.passed:
        raise typer.Exit(1)


def _read(path: Path) -> "tuple[Case, ...]":
    from app.quality.proof.cases import case_from

    try:
        return tuple(case_from(described) for described in json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InbandError(
            _("{path} holds no examples that can be read: {error}").format(path=path, error=error),
            _("Write a list of examples as the files in app/quality/proof/cases do."),
        ) from None


def _tell(proof: "Proof") -> None:
    from app.quality.proof import wording

    for result in proof.results:
        mark = "[green]ok[/green]   " if result.passed else "[bold red]wrong[/bold red]"
        people.print(mark, end=" ")
        say(f"{result.case.name} – {result.case.source}")
        if result.error:
            say(f"      {result.error}", style="bold red")
        for check in result.checks:
            if not check.passed:
                words = _("{name}: published {expected}, computed {got}, may differ by {tolerance}").format(
                    name=check.name,
                    expected=wording.written(check.expected),
                    got=wording.written(check.got),
                    tolerance=f"{check.tolerance:.2g}",
                )
                say(f"      {words}", style="bold red")
    counts = _("{examples} examples, {numbers} numbers: ").format(examples=len(proof.results), numbers=proof.numbers)
    if proof.passed:
        say(counts + _("all as published, or as expected where the source says how."), style="bold")
    else:
        say(counts + _("{failing} not as published.").format(failing=len(proof.failing)), style="bold red")
