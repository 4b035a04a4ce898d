"""Verbs: an act is done once or not at all, whoever sends it how often, and its form is read by the types of its body."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

import httpx
import pytest
from fastapi import FastAPI

from app.access.callers import Caller
from app.errors import Conflict, Invalid, NotAllowed, NotFound
from app.web.api import api_router
from app.web.fields import Body, Length, Reason
from app.web.verb import Size, Verb, add_json_route, carry_out, named, said
from tests.loops import run

ANA = Caller("person", "ana", "operator")


class Transaction:
    """Stands for a session: what is written in a savepoint that fails is gone."""

    def __init__(self) -> None:
        self.written: list[str] = []
        self.expired = 0

    @contextmanager
    def begin_nested(self) -> Iterator[None]:
        before = list(self.written)
        try:
            yield
        except BaseException:
            self.written[:] = before
            raise

    def expire_all(self) -> None:
        self.expired += 1


@dataclass(frozen=True)
class OfDoor:
    """A door, and who acts on it."""

    number: int = 7
    caller: Caller = ANA
    closed_by: list[str] = field(default_factory=list)
    session: Any = field(default_factory=Transaction)

    @property
    def values(self) -> Mapping[str, Any]:
        return {"number": self.number}


class CloseIn(Body):
    reason: Reason
    gap: Length | None = None
    forced: Annotated[bool, "a tick"] = False
    side: Literal["left", "right"] | None = None


def close_door(on: OfDoor, how: CloseIn) -> str:
    """Close the door."""
    on.session.written.append("closing")
    if on.closed_by and not how.forced:
        raise Conflict("It is closed.", "Nothing is left to do.", warned=how.gap)
    on.closed_by.append(on.caller.name)
    return f"closed {how.reason}"


CLOSE: Verb[OfDoor, CloseIn] = Verb(
    name="close",
    body=CloseIn,
    act=close_door,
    own=lambda on: on.closed_by == [on.caller.name],
    asks_again=lambda error: error.more["warned"] is not None,
    word=lambda: "Close",
    title=lambda _on: "Close door {number}?",
    follows=lambda _on: ["Nobody comes in any more: {not a name}."],
    reasons=lambda: ["Cold"],
    size=lambda on: Size("gap", "Gap", f"R{on.number}"),
    said=lambda: "Door {n} is closed.",
    when=("open",),
    fits=lambda on: on.number > 0,
)


class TestCarryOut:
    def test_done(self) -> None:
        on = OfDoor()
        outcome = carry_out(CLOSE, on, {"reason": "Cold", "more": "draught", "do": "close"})
        assert (outcome.kind, outcome.said, on.closed_by) == ("done", ("close", 7), ["ana"])

    def test_sent_twice_it_is_done_once(self) -> None:
        on = OfDoor()
        for _time in range(2):
            assert carry_out(CLOSE, on, {"reason": "Cold"}).kind == "done"
        assert (on.closed_by, on.session.written, on.session.expired) == (["ana"], ["closing"], 1)

    def test_somebody_else_was_first(self) -> None:
        on = OfDoor(closed_by=["boris"])
        assert carry_out(CLOSE, on, {"reason": "Cold"}).kind == "late"
        assert (on.closed_by, on.session.written) == (["boris"], [])

    def test_a_new_warning_asks_again(self) -> None:
        assert carry_out(CLOSE, OfDoor(closed_by=["boris"]), {"reason": "Cold", "gap": "−0,5"}).kind == "ask"

    @pytest.mark.parametrize(
        ("form", "wrong"),
        [({}, "reason"), ({"reason": "x", "gap": "wide"}, "gap"), ({"reason": "x", "side": "up"}, "side")],
    )
    def test_what_is_wrong_is_named_and_nothing_is_done(self, form: dict[str, str], wrong: str) -> None:
        on = OfDoor()
        with pytest.raises(Invalid) as refused:
            carry_out(CLOSE, on, form)
        assert [error.field for error in refused.value.errors] == [wrong]
        assert (on.closed_by, on.session.written) == ([], [])


class TestRole:
    MACHINE = Caller("machine", "lathe-1", machine_id=1)

    def test_a_lower_role_does_nothing(self) -> None:
        on = OfDoor()
        engineers = replace(CLOSE, role="engineer")
        with pytest.raises(NotAllowed, match="needs the role engineer; ana has the role operator"):
            carry_out(engineers, on, {"reason": "Cold"})
        assert (on.closed_by, on.session.written) == ([], [])
        assert (CLOSE.permits(ANA), engineers.permits(ANA)) == (True, False)

    def test_a_machine_does_its_own_alone(self) -> None:
        on = OfDoor(caller=self.MACHINE)
        with pytest.raises(NotAllowed, match="key of machine"):
            carry_out(CLOSE, on, {"reason": "Cold"})
        assert carry_out(replace(CLOSE, by_machine=True), on, {"reason": "Cold"}).kind == "done"

    def test_a_machines_own_act_asks_people_for_the_role(self) -> None:
        with pytest.raises(NotAllowed):
            carry_out(replace(CLOSE, by_machine=True, role="engineer"), OfDoor(), {"reason": "Cold"})


def test_the_question_is_drawn_from_the_declaration() -> None:
    question = CLOSE.question(OfDoor(), "/doors/7", back="list")
    assert (question.title, question.button, question.send_to) == ("Close door 7?", "Close", "/doors/7")
    assert question.follows == ["Nobody comes in any more: {not a name}."]  # text of people is never a pattern
    assert question.size == Size("gap", "Gap", "R7")
    assert question.hidden == {"do": "close", "back": "list"}


def test_a_verb_is_found_by_its_name_where_it_fits() -> None:
    assert named([CLOSE], "close", OfDoor(), "Go back.") is CLOSE
    for name, number in (("open", 7), ("close", 0)):
        with pytest.raises(NotFound, match="nothing at this address"):
            named([CLOSE], name, OfDoor(number), "Go back.")
    assert (said([CLOSE], "close", 7), said([CLOSE], "open", 7)) == ("Door 7 is closed.", None)


def test_the_json_route_has_name_and_text_of_the_act() -> None:
    router = api_router("doors")
    add_json_route(
        router,
        "/doors/{number}/close",
        CLOSE,
        lambda number: OfDoor(int(number)),
        lambda on, done: [on.number, done],
        list,
    )
    app = FastAPI()
    app.include_router(router)
    described = app.openapi()["paths"]["/api/v1/doors/{number}/close"]["post"]
    assert (described["description"], described["operationId"].split("_doors")[0]) == ("Close the door.", "close_door")

    async def answered() -> Any:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://doors") as client:
            return (await client.post("/api/v1/doors/3/close", json={"reason": "Cold"})).json()

    assert run(answered()) == [3, "closed Cold"]
