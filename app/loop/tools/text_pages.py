"""Page: the pending corrections of a machine as program text, who fetched it, and that it is in the control."""

from hashlib import sha256
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from app.access.deps import Operator, Viewer
from app.core.programs.correction_forms import FORMS, Form
from app.core.programs.corrections import MOST_STEPS
from app.errors import NotFound
from app.language.i18n import _, ngettext
from app.loop.machines.queries import machine_named
from app.loop.programs import wording
from app.loop.tools import fetching
from app.loop.tools.text_api import corrections_file
from app.web import paging
from app.web.deps import FormDep, SessionDep
from app.web.fields import LARGEST_SERIAL
from app.web.templates import page
from app.web.verb import Question

router = APIRouter(include_in_schema=False)
Count = Annotated[int, Query(ge=0, le=LARGEST_SERIAL)]


def address(machine: str, **query: str | int) -> str:
    """The page of a machine's corrections as text."""
    return paging.address(f"/machines/{machine}/corrections/program", **query)


@router.get("/machines/{machine}/corrections/program")
def corrections_page(
    request: Request,
    session: SessionDep,
    caller: Viewer,
    machine: str,
    form: Form | None = None,
    do: Annotated[str, Query(max_length=40)] = "",
    done: Annotated[str, Query(max_length=40)] = "",
    now: Count = 0,
    already: Count = 0,
    fell: Count = 0,
    shown: Annotated[str | None, Query(max_length=40)] = None,
) -> Response:
    """The text with copy, download and what to say about it; with ``do=applied`` it asks for the second touch.

    shown: check sum of the text that is on the screen; the page says whether another one is there by now.
    """
    machine_row = machine_named(session, machine)
    handed = fetching.pending_text(session, machine_row, form)
    confirms = caller.may("operator") and do == "applied" and bool(handed.numbers)
    return page(
        request,
        "programs/corrections.html",
        machine=machine_row,
        handed=handed,
        rows=list(zip(handed.corrections, handed.chain, strict=True)),
        fresh=[c.number for c in handed.corrections if c.fetched_at is None],
        forms=[
            (choice.value, wording.form_word(choice), choice == handed.form) for choice in FORMS[machine_row.control]
        ],
        guarded=wording.guarded(handed.form),
        fallen=fetching.at_large(session, machine_row),
        said=_said(done, now, already, fell),
        question=_question(machine_row.key, handed) if confirms else None,
        download=f"/api/v1{address(machine_row.key, form=handed.form.value)}",
        file=corrections_file(machine_row.key, machine_row.control),
        address=address,
        shown=_state(handed),
        newer=shown is not None and shown != _state(handed),
    )


def _state(handed: fetching.Handed) -> str:
    """Tells one set of pending corrections from another, in whatever form they are written."""
    return sha256(repr(handed.chain).encode()).hexdigest()[:12]


def _said(done: str, now: int, already: int, fell: int) -> list[str]:
    """The result of the action on the page before."""
    if done == "fetched":
        before = ngettext("{n} was fetched before.", "{n} were fetched before.", already).format(n=already)
        return [
            _("Marked as fetched. They stay pending until they are in the control."),
            *([before] if already else []),
        ]
    if done != "applied":
        return []
    sentences = [ngettext("{n} correction is applied now.", "{n} corrections are applied now.", now).format(n=now)]
    if already:
        sentences.append(_("{n} had been confirmed before.").format(n=already))
    if fell:
        sentences.append(
            ngettext(
                "{n} was rejected or superseded meanwhile and must not be in the offset: see below.",
                "{n} were rejected or superseded meanwhile and must not be in the offset: see below.",
                fell,
            ).format(n=fell)
        )
    return sentences


def _question(machine: str, handed: fetching.Handed) -> Question:
    numbers = ", ".join(map(str, handed.numbers))
    return Question(
        ngettext(
            "Is {n} correction in the control?", "Are all {n} corrections in the control?", len(handed.numbers)
        ).format(n=len(handed.numbers)),
        _("All are applied"),
        [
            _("Applied from now on: {numbers}.").format(numbers=numbers),
            _(
                "The offsets known here change as the text changes them. If the text stopped with a message, do not confirm."
            ),
        ],
        send_to=address(machine),
        hidden={"do": "applied", "numbers": " ".join(map(str, handed.numbers)), "form": handed.form.value},
    )


@router.post("/machines/{machine}/corrections/program")
def tell(session: SessionDep, caller: Operator, machine: str, form: FormDep) -> Response:
    """The text was fetched, or it was run. The numbers are those that the page had shown, whatever has come since."""
    machine_row = machine_named(session, machine)
    numbers = [int(word) for word in form.get("numbers", "").split() if word.isascii() and word.isdigit()]
    numbers = [number for number in numbers if 0 < number <= LARGEST_SERIAL][:MOST_STEPS]
    chosen = form.get("form") if form.get("form") in FORMS[machine_row.control] else None
    outcome: dict[str, str | int] = {} if chosen is None else {"form": chosen}
    match form.get("do"):
        case "fetched" if numbers:
            marked = fetching.mark_fetched(session, machine_row, numbers, chosen, caller)
            outcome |= {"done": "fetched", "already": sum(correction.before for correction in marked)}
        case "applied" if numbers:
            done = fetching.confirm_all(session, machine_row, numbers, caller)
            outcome |= {
                "done": "applied",
                "now": len(done.now),
                "already": len(done.already),
                "fell": len(done.refused),
            }
        case _:
            raise NotFound(_("The form does not say what to do with which corrections."), _("Load the page again."))
    return RedirectResponse(address(machine, **outcome), 303)
