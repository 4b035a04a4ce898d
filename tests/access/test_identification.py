"""Who acts at a station: by PIN or badge, and slowed down where it is guessed. In the database, as any process counts."""

import re
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime

import pytest
from sqlalchemy import select

from app.access import actions
from app.access.audit.queries import entries
from app.access.callers import Caller
from app.access.devices import Device
from app.access.identification import (
    FREE,
    FREE_BADGES,
    FREE_ON_DEVICE,
    NotIdentified,
    Shown,
    add_badge,
    identify,
    set_pin,
)
from app.access.tables import LoginFailure
from app.db.engine import Database
from app.errors import TooManyRequests
from app.language.times import plant_zone

PASSWORD, PIN, BADGE = "correct horse battery", "2746", "0004711882"
HERE, ELSEWHERE = (Device(number, f"Tablet {number}", 1, "lathe-1", "") for number in (1, 2))


@pytest.fixture
def ana(database: Database) -> int:
    """The number of an operator with a PIN and a badge."""
    with database.begin() as session:
        person = actions.add_person(session, name="Ana", role="operator", password=PASSWORD, actor="tests")
        caller = Caller("person", person.name, role="operator", person_id=person.id)
        set_pin(session, caller, PASSWORD, PIN, None)
        add_badge(session, person.id, BADGE, "tests")
        return person.id


def seen(database: Database, shown: Shown, device: Device = HERE) -> str:
    """Who it is, or why not."""
    try:
        return identify(database, device, shown).name
    except (NotIdentified, TooManyRequests) as error:
        return error.kind


def wrong(database: Database, number: int, name: str = "Ana", device: Device = HERE) -> list[str]:
    return [seen(database, Shown(name, "9999"), device) for _attempt in range(number)]


def test_by_pin_or_badge_and_who_has_no_access_any_more_by_neither(database: Database, ana: int) -> None:
    for shown in (Shown("ana", PIN), Shown(badge=f" {BADGE[:4]} {BADGE[4:]} ")):
        assert seen(database, shown) == "Ana"
    with database.begin() as session:
        actions.disable_person(session, ana, "tests")
    for shown in (Shown("Ana", PIN), Shown(badge=BADGE)):
        assert seen(database, shown) == "not-identified"


def test_a_name_is_locked_in_any_spelling_and_on_one_device(database: Database, ana: int) -> None:
    spellings = ["Ana", "ANA", "ana", "aNa", "anA"]
    assert [wrong(database, 1, name) for name in spellings] == [["not-identified"]] * FREE
    assert seen(database, Shown("AnA", PIN)) == "too-many-requests"
    assert seen(database, Shown("Ana", PIN), ELSEWHERE) == "Ana"
    assert seen(database, Shown("Ana", PIN)) == "too-many-requests", "what was right elsewhere frees nothing here"


def test_the_right_pin_forgets_the_wrong_ones(database: Database, ana: int) -> None:
    for _round in range(2):
        assert wrong(database, FREE - 1) == ["not-identified"] * (FREE - 1)
        assert seen(database, Shown("Ana", PIN)) == "Ana"
    with database.begin() as session:
        assert session.scalars(select(LoginFailure)).all() == []


def test_guessing_badges_is_slowed_down_whatever_person_shows_an_own_one_between(database: Database, ana: int) -> None:
    for number in range(FREE_BADGES):
        assert seen(database, Shown(badge=f"77001122{number:02}")) == "not-identified"
        if number < FREE_BADGES - 1:
            assert seen(database, Shown(badge=BADGE)) == "Ana", "a few scans of others lock nobody"
    assert seen(database, Shown(badge=BADGE)) == "too-many-requests"
    assert seen(database, Shown("Ana", PIN)) == "Ana", "a PIN is counted apart"
    assert seen(database, Shown(badge=BADGE), ELSEWHERE) == "Ana"


def test_one_unknown_badge_counts_once_however_often_it_is_scanned(database: Database, ana: int) -> None:
    for _scan in range(3):
        assert seen(database, Shown(badge="7700112233")) == "not-identified"
    with database.begin() as session:
        assert len(session.scalars(select(LoginFailure)).all()) == 1


@pytest.mark.long
def test_badges_guessed_at_once_are_all_counted(database: Database, ana: int) -> None:
    shown = [Shown(badge=f"77001122{number:02}") for number in range(FREE_BADGES + 4)]
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda each: seen(database, each), shown))
    assert (answers.count("not-identified"), answers.count("too-many-requests")) == (FREE_BADGES, 4)


@pytest.mark.parametrize(("failed", "answer"), [(FREE_ON_DEVICE - 1, "Ana"), (FREE_ON_DEVICE, "too-many-requests")])
def test_guessing_many_names_locks_the_device_for_strangers(
    database: Database, ana: int, failed: int, answer: str
) -> None:
    with database.begin() as session:
        session.add_all(LoginFailure(name=f"name {number}", address="station 1") for number in range(failed))
    assert seen(database, Shown("Ana", PIN)) == answer
    assert seen(database, Shown("Ana", PIN), ELSEWHERE) == "Ana"


@pytest.mark.parametrize("before", [Shown("Ana", PIN), Shown(badge=BADGE)])
def test_guessing_many_names_keeps_nobody_out_who_works_there(database: Database, ana: int, before: Shown) -> None:
    assert seen(database, before) == "Ana"
    with database.begin() as session:
        session.add_all(LoginFailure(name=f"name {number}", address="station 1") for number in range(FREE_ON_DEVICE))
    assert seen(database, Shown("Ana", PIN)) == "Ana"
    assert wrong(database, FREE)[-1] == "not-identified"
    assert seen(database, Shown("Ana", PIN)) == "too-many-requests", "their own PIN is locked when it is guessed"


def test_the_lock_is_over_when_it_says(database: Database, ana: int) -> None:
    wrong(database, FREE)
    with pytest.raises(TooManyRequests) as refused:
        identify(database, HERE, Shown("Ana", PIN))
    said = re.search(r"until (.+)\.", refused.value.detail)
    assert said is not None
    assert refused.value.retry_after is not None
    until = datetime.strptime(said[1], "%d %b %Y %H:%M").replace(tzinfo=plant_zone())
    assert 0 <= (until - datetime.now(plant_zone())).total_seconds() - refused.value.retry_after + 2 <= 64


@pytest.mark.parametrize("who", ["the person", "an administrator"])
def test_a_new_password_ends_the_pin(database: Database, ana: int, who: str) -> None:
    with database.begin() as session:
        if who == "the person":
            caller = Caller("person", "Ana", role="operator", person_id=ana)
            assert actions.change_password(session, caller, PASSWORD, "battery horse correct", None)
        else:
            new = actions.reset_password(session, ana, "tests")
            assert (new.name, new.had_pin, new.badges) == ("Ana", True, 1)
        assert "PIN removed" in [entry.action for entry in entries(session)]
    assert seen(database, Shown("Ana", PIN)) == "not-identified"
    assert seen(database, Shown(badge=BADGE)) == "Ana", "badges are asked about"
