"""A verb: something a person does to one thing, declared once.

A room declares its verbs. Each is drawn as a page that asks and does (`add_question_page`), as a dialog and at a station
(`Verb.question`, `carry_out`) and as a JSON route (`add_json_route`); the button, the sentence afterwards and the form follow from the
declaration. The role it needs, the savepoint, "someone else was first" and "sent twice" are here and nowhere else.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Generic, Literal, NamedTuple, Protocol, TypeVar

from fastapi import APIRouter, Depends, Request, Response
from pydantic import BaseModel
from sqlalchemy.orm import Session

from app.errors import Conflict, InbandError, Invalid, NotFound
from app.language.i18n import _
from app.web.api import problems
from app.web.deps import FormDep
from app.web.forms import typed
from app.web.templates import page


class Actor(Protocol):
    """A person, a key with a person's role, or a machine's own key."""

    @property
    def machine_id(self) -> int | None:
        """The machine whose own key it is, or None."""
        ...

    def may(self, role: Any) -> bool:
        """Tell if the actor has this role or a higher one."""
        ...

    def must(self, role: Any) -> None:
        """Raises `NotAllowed` unless the actor `may`."""
        ...


class Subject(Protocol):
    """A thing with its caller and session, and the words for it in sentences."""

    @property
    def caller(self) -> Actor:
        """The person or key that acts on it."""
        ...

    @property
    def session(self) -> Session:
        """The transaction of the request."""
        ...

    @property
    def number(self) -> int:
        """By which sentences and addresses name it."""
        ...

    @property
    def values(self) -> Mapping[str, Any]:
        """The words that a sentence may name: ``{"number": 12, "tool": 3}``."""
        ...


On = TypeVar("On", bound=Subject)
Sent = TypeVar("Sent", bound=BaseModel)


class Said(NamedTuple):
    """The code of the sentence after an act, and the number in it, where they are not the verb's and the thing's."""

    code: str
    number: int


class Outcome(NamedTuple):
    """The end of an act: done; late, someone else was first; ask, the question is another one now.

    result: what the act returned; refused: why it is late, in words.
    """

    kind: Literal["done", "late", "ask"]
    said: Said
    result: Any = None
    refused: str = ""


@dataclass(frozen=True)
class Size:
    """The one length that a question may ask for. name: its field; r: the R number it has; value: typed already."""

    name: str
    label: str
    r: str
    value: str = ""
    hint: str = ""
    needed: bool = False


@dataclass(frozen=True)
class Question:
    """Content of a confirmation dialog: what follows, reasons to choose from, where it is sent, and hidden fields.

    likely: the reason that is chosen already; where: the place at the machine that it is about.
    """

    title: str
    button: str
    follows: list[str]
    reasons: list[str] = field(default_factory=list)
    likely: str = ""
    size: Size | None = None
    send_to: str = ""
    hidden: dict[str, str] = field(default_factory=dict)
    where: str = ""


@dataclass(frozen=True, kw_only=True)
class Act(Generic[On, Sent]):
    """One act on one kind of thing.

    act: does it; raises `Conflict` when the thing does not permit it any more. Its name and docstring describe the JSON route.
    role: which people may do it, at least; nobody else is offered it.
    own: after a `Conflict`, tells if the caller had done the same before. asks_again: tells if a `Conflict` is a new warning to
    be shown with the question. needs_body: False where JSON may leave it out.
    by_machine: a machine's own key may do it.
    """

    name: str
    body: type[Sent]
    act: Callable[[On, Sent], Any]
    own: Callable[[On], bool] = lambda _on: False
    asks_again: Callable[[Conflict], bool] = lambda _error: False
    needs_body: bool = True
    by_machine: bool = False
    role: Literal["operator", "engineer", "admin"] = "operator"

    def permits(self, caller: Actor) -> bool:
        """Tell if the caller has the role for it."""
        return caller.may(self.role)

    def do(self, on: On, sent: Sent) -> Any:
        """Do it. Raises `NotAllowed` for a caller who may not."""
        if not (self.by_machine and on.caller.machine_id is not None):
            on.caller.must(self.role)
        return self.act(on, sent)


@dataclass(frozen=True, kw_only=True)
class Verb(Act[On, Sent]):
    """An act with its question. A title names the `values` of the subject as {number}, the sentence afterwards {n}.

    word: on its button; follows: the consequences; reasons: likely ones; likely: the one that is chosen already, because it
    claims nothing that the person has to have looked at; size: the length that is asked for; said: afterwards.
    when: states of the thing in which it is offered; fits: tells if it can be asked of this one.
    """

    word: Callable[[], str]
    title: Callable[[On], str]
    follows: Callable[[On], list[str]]
    said: Callable[[], str]
    reasons: Callable[[], list[str]] = list
    likely: Callable[[], str] = str
    size: Callable[[On], Size] | None = None
    hidden: Callable[[On], dict[str, str]] = lambda _on: {}
    when: tuple[str, ...] = ()
    fits: Callable[[On], bool] = lambda _on: True

    def question(self, on: On, send_to: str, **hidden: str) -> Question:
        """The dialog that asks for it, and the form that does it."""
        values = on.values
        return Question(
            self.title(on).format(**values),
            self.word(),
            self.follows(on),
            self.reasons(),
            self.likely(),
            self.size(on) if self.size else None,
            send_to,
            {"do": self.name, **self.hidden(on), **hidden},
            values.get("where", ""),
        )


def carry_out(verb: Act[On, Sent], on: On, form: Mapping[str, str]) -> Outcome:
    """Do what the form asks for, or nothing of it; sent twice by one person it is done once.

    Raises `Invalid`, `NotAllowed`, `NotFound`.
    """
    sent, usual = typed(verb.body, form), Said(verb.name, on.number)
    try:
        with on.session.begin_nested():
            result = verb.do(on, sent)
    except Conflict as error:
        on.session.expire_all()
        if verb.asks_again(error):
            return Outcome("ask", usual)
        refused = f"{error.detail} {error.advice}"
        return Outcome("done" if verb.own(on) else "late", usual, None, refused)
    return Outcome("done", result if isinstance(result, Said) else usual, result)


def named(verbs: Iterable[Verb[On, Any]], name: str, on: On, back: str) -> Verb[On, Any]:
    """The verb of this name that fits the thing. back: where to go if there is none. Raises `NotFound`."""
    for verb in verbs:
        if verb.name == name and verb.fits(on):
            return verb
    raise NotFound(_("There is nothing at this address."), back)


def said(
    verbs: Iterable[Verb[Any, Any]], name: str, number: int | None, more: Mapping[str, str] | None = None
) -> str | None:
    """The page's message after the act, or one of `more`, which has those of what is no verb; None for an unknown name."""
    words = (more or {}).get(name) or next((verb.said() for verb in verbs if verb.name == name), None)
    return None if words is None else words.format(n=number or 0)


def ask(
    request: Request,
    template: str,
    question: Question,
    form: Mapping[str, str] | None = None,
    error: InbandError | None = None,
    **context: Any,
) -> Response:
    """The page of a question. form, error: what was sent, and why it is refused."""
    return page(request, template, refusal=error, question=question, form=form or {}, **context)


def add_question_page(
    router: APIRouter,
    path: str,
    verbs: Sequence[Verb[On, Any]],
    subject: Any,
    *,
    around: Callable[[On, Verb[On, Any]], Mapping[str, Any]],
    after: Callable[[Request, On, Verb[On, Any], Outcome], Response],
    astray: Callable[[], str],
    reads: Callable[[Mapping[str, str]], Mapping[str, str]] = lambda form: form,
    template: str = "tools/ask.html",
) -> None:
    """Add the page that asks, and that does what its form says. With several verbs the path names one as ``{what}``.

    subject: the dependency that finds the thing for a caller of the role; around: what the template shows around the question;
    after: the answer to what was done, or came too late; astray: where to go if there is no such verb; reads: the form's fields
    as those of the body, where they differ.
    """

    def asked(request: Request, on: On) -> Verb[On, Any]:
        return named(verbs, request.path_params.get("what", verbs[0].name), on, astray())

    def shown(
        request: Request, on: On, form: Mapping[str, str] | None = None, error: InbandError | None = None
    ) -> Response:
        verb = asked(request, on)
        question = verb.question(on, path.format(**request.path_params))
        return ask(request, template, question, form, error, **around(on, verb))

    def question(request: Request, on: Any) -> Response:
        on.caller.must(asked(request, on).role)
        return shown(request, on)

    def answer(request: Request, on: Any, form: FormDep) -> Response:
        verb = asked(request, on)
        try:
            outcome = carry_out(verb, on, reads(form))
        except Invalid as error:
            return shown(request, on, form, error)
        return after(request, on, verb, outcome)

    question.__annotations__["on"] = answer.__annotations__["on"] = Annotated[Any, Depends(subject)]
    router.get(path)(question)
    router.post(path)(answer)


def add_json_route(
    router: APIRouter,
    path: str,
    verb: Act[On, Any],
    subject: Any,
    answer: Callable[[On, Any], Any],
    model: Any,
    asks: Sequence[Any] = (),
) -> None:
    """Add the JSON route that does it.

    subject: the dependency that finds the thing; answer: from it and what `act` returns; asks: dependencies that refuse callers
    before their body is looked at.
    """
    body: Any = verb.body if verb.needs_body else verb.body | None

    def route(on: Any, sent: Any = None) -> Any:
        return answer(on, verb.do(on, sent if sent is not None else verb.body()))

    route.__name__, route.__doc__ = verb.act.__name__, verb.act.__doc__
    route.__annotations__ = {"on": Annotated[Any, Depends(subject)], "sent": body, "return": model}
    if verb.needs_body:
        route.__defaults__ = None
    router.post(path, responses=problems(404, 409), dependencies=asks)(route)
