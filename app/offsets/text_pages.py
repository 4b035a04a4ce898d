"""Page: the pending corrections of a machine as program text, who fetched it, and that it is in the control."""

from hashlib import sha256
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from starlette.responses import RedirectResponse

from app.core.programs.corrections import FORMS, MOST_STEPS, Form
from app.errors import NotFound
from app.machines.queries import machine_named
from app.offsets import fetching
from app.offsets.asking import Question
from app.offsets.text_api import corrections_file
from app.programs import wording
from app.web.deps import FormDep, Operator, SessionDep, Viewer
from app.web.fields import LARGEST_SERIAL
from app.web.i18n import _, ngettext
from app.web.templates import page

router = APIRouter(include_in_schema=False)
Count = Annotated[int, Query(ge=0, le=LARGEST_SERIAL)]


def address(machine: str, **query: str | int) -> str:
    """The page of a machine's corrections as text."""
    return f"/machines/{machine}/corrections/program" + (f"?{urlencode(query)}" if query else "")


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

    shown: check sum of the text that is on the screen; the page says whether another one stands there by now.
    """
    found = machine_named(session, machine)
    handed = fetching.pending_text(session, found, form)
    asked = caller.may("operator") and do == "applied" and bool(handed.numbers)
    return page(
        request,
        "programs/corrections.html",
        machine=found,
        handed=handed,
        rows=list(zip(handed.corrections, handed.chain, strict=True)),
        fresh=[c.number for c in handed.corrections if c.fetched_at is None],
        forms=[(each.value, wording.form_word(each), each == handed.form) for each in FORMS[found.control]],
        guarded=wording.guarded(handed.form),
        fallen=fetching.at_large(session, found),
        said=_said(done, now, already, fell),
        question=_question(found.key, handed) if asked else None,
        download=f"/api/v1{address(found.key, form=handed.form.value)}",
        file=corrections_file(found.key, found.control),
        address=address,
        shown=_state(handed),
        newer=shown is not None and shown != _state(handed),
    )


def _state(handed: fetching.Handed) -> str:
    """Tells one set of pending corrections from another, in whatever form they are written."""
    return sha256(repr(handed.chain).encode()).hexdigest()[:12]


def _said(done: str, now: int, already: int, fell: int) -> list[str]:
    """What the page before has done."""
    if done == "fetched":
        before = ngettext("{n} was fetched before.", "{n} were fetched before.", already).format(n=already)
        return [
            _("Marked as fetched. They stay pending until they are in the control."),
            *([before] if already else []),
        ]
    if done != "applied":
        return []
    said = [ngettext("{n} correction is applied now.", "{n} corrections are applied now.", now).format(n=now)]
    if already:
        said.append(_("{n} had been confirmed before.").format(n=already))
    if fell:
        said.append(
            ngettext(
                "{n} was rejected or superseded meanwhile and must not be in the offset: see below.",
                "{n} were rejected or superseded meanwhile and must not be in the offset: see below.",
                fell,
            ).format(n=fell)
        )
    return said


def _question(machine: str, handed: fetching.Handed) -> Question:
    numbers = ", ".join(map(str, handed.numbers))
    return Question(
        ngettext(
            "Is {n} correction in the control?", "Are all {n} corrections in the control?", len(handed.numbers)
        ).format(n=len(handed.numbers)),
        _("All are applied"),
        address(machine),
        [
            _("Applied from now on: {numbers}.").format(numbers=numbers),
            _(
                "The offsets known here change as the text changes them. If the text stopped with a message, do not confirm."
            ),
        ],
        hidden={"do": "applied", "numbers": " ".join(map(str, handed.numbers)), "form": handed.form.value},
    )


@router.post("/machines/{machine}/corrections/program")
def tell(session: SessionDep, caller: Operator, machine: str, form: FormDep) -> Response:
    """The text was fetched, or it was run. The numbers are those that the page had shown, whatever has come since."""
    shown = machine_named(session, machine)
    numbers = [int(word) for word in form.get("numbers", "").split() if word.isascii() and word.isdigit()]
    numbers = [number for number in numbers if 0 < number <= LARGEST_SERIAL][:MOST_STEPS]
    chosen = form.get("form") if form.get("form") in FORMS[shown.control] else None
    said: dict[str, str | int] = {} if chosen is None else {"form": chosen}
    match form.get("do"):
        case "fetched" if numbers:
            marked = fetching.mark_fetched(session, shown, numbers, chosen, caller)
            said |= {"done": "fetched", "already": sum(each.before for each in marked)}
        case "applied" if numbers:
            done = fetching.confirm_all(session, shown, numbers, caller)
            said |= {"done": "applied", "now": len(done.now), "already": len(done.already), "fell": len(done.refused)}
        case _:
            raise NotFound(_("The form does not say what to do with which corrections."), _("Load the page again."))
    return RedirectResponse(address(machine, **said), 303)
