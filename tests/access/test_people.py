"""People: invitations, roles, ending access, passwords, and never losing the last administrator."""

import re
import threading
import unicodedata
from contextlib import suppress
from typing import Any

import httpx
import pytest
from sqlalchemy import func, update
from sqlalchemy.orm import Session

from app.access import actions, queries
from app.access.audit.queries import entries
from app.access.callers import Caller
from app.access.sign_in import begin_session, sign_in
from app.access.tables import Invitation
from app.db.engine import Database
from app.errors import Conflict, Invalid, NotFound
from tests.shop import unique

pytestmark = pytest.mark.own_server
PASSWORD = "correct horse battery"


def add(session: Session, name: str, role: str = "viewer") -> Any:
    return actions.add_person(session, name=name, role=role, password=PASSWORD, actor="tests")


def audit(session: Session) -> list[tuple[str, str]]:
    return [(entry.action, entry.subject) for entry in entries(session)]


class TestAdding:
    def test_one_name_in_any_spelling(self, session: Session) -> None:
        add(session, "Милан")
        with pytest.raises(Conflict):
            add(session, "МИЛАН")
        assert queries.person_named(session, "милан") is not None

    @pytest.mark.parametrize("name", ["", "   ", "x" * 201, "a\nb", "a\0b", "\ud800"])
    def test_bad_names(self, session: Session, name: str) -> None:
        with pytest.raises(Invalid) as refused:
            add(session, name)
        assert refused.value.errors[0].field == "name"

    @pytest.mark.parametrize(
        "password",
        [
            "",
            "short",
            "aaaaaaaaaaaa",
            "anastasija12",
            "x" * 201,
            "\ud800" * 20,
            "correct \ud800 horse battery",
            "password1234",
            "P@ssw0rd2026!",
            "1234567890",
            "qwertzuiop12",
            "abcabcabcabc",
            "Inband-2026-Inband",
            "drowssap1234",
            "Lozinka123!",
        ],
    )
    def test_bad_passwords(self, session: Session, password: str) -> None:
        with pytest.raises(Invalid) as refused:
            actions.add_person(session, name="Anastasija", role="viewer", password=password, actor="tests")
        assert refused.value.errors[0].field == "password"

    def test_the_password_is_not_kept_and_not_recorded(self, session: Session) -> None:
        person = add(session, "Ana")
        assert person.password_hash.startswith("$argon2id$")
        assert PASSWORD not in str([(entry.before, entry.after) for entry in entries(session)])


class TestNames:
    @pytest.mark.parametrize(
        "name",
        [
            "key admin",
            "KEY-admin",
            "inband serve",
            "In-Band",
            "Inband",
            "command line (root)",
            "xss (key k)",
            "Ana (invitation)",
            "аna",  # a Cyrillic letter among Latin ones
            "Ana\u200b",
            "Ana\u202e",
            "A\u200dna",
            "Ana\ufe0f",
            "\u3164",
            "A\u115fna",
            "--",
        ],
    )
    def test_that_pose_or_cannot_be_seen_are_refused(self, session: Session, name: str) -> None:
        with pytest.raises(Invalid) as refused:
            add(session, name)
        assert refused.value.errors[0].field == "name"

    @pytest.mark.parametrize(
        ("name", "twin"),
        [
            ("admin", "adm1n"),
            ("Milo", "MiIo"),
            ("Мара", "Mapa"),
            ("tom", "том"),
            ("adm", "ａｄｍ"),
            ("Ana", "ᴀna"),
            ("am", "arn"),
        ],
    )
    def test_twins_by_their_looks(self, session: Session, name: str, twin: str) -> None:
        add(session, name)
        with pytest.raises(Conflict, match="looks like"):
            add(session, twin)

    @pytest.mark.parametrize(
        "name",
        [
            "Ђорђе Јовановић",
            "Иван Петров",
            "王小明",
            "さくら タナカ",
            "김철수",
            "O’Brien",
            "Žana Kovač-Šarić",
            "J. Müller",
            "नरेन्द्र",
            "محمد علي",
            "shift 2",
            "ana@inband.example",
            "Cafe\u0301",
        ],
    )
    def test_anyone_who_is_added_can_sign_in(self, database: Database, name: str) -> None:
        with database.begin() as session:
            add(session, name)
        for typed in (name, f" {name.upper()} ", unicodedata.normalize("NFD", name)):
            assert sign_in(database, typed, PASSWORD, "10.0.0.1", 1).token

    def test_of_keys_are_seen_too(self, session: Session) -> None:
        for name in ("night\u200breport", "r\u202eport", "nіght"):
            with pytest.raises(Invalid):
                actions.add_role_key(session, name=name, role="viewer", actor="tests")

    def test_two_alike_at_once(self, database: Database) -> None:
        made: list[str] = []

        def join(name: str) -> None:
            with suppress(Conflict), database.begin() as session:
                made.append(add(session, name).name)

        threads = [threading.Thread(target=join, args=(name,)) for name in ("admin", "adm1n")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(made) == 1


class TestInvitations:
    def test_a_link_works_once(self, session: Session) -> None:
        token = actions.create_invitation(session, "engineer", "Ana")
        person = actions.accept_invitation(session, token, "Bojan", PASSWORD)
        assert person.role == "engineer"
        with pytest.raises(NotFound):
            actions.accept_invitation(session, token, "Ceca", PASSWORD)
        assert audit(session)[:2] == [("person added", "person/Bojan"), ("invitation made", "people")]

    def test_a_withdrawn_or_made_up_link_does_not(self, session: Session) -> None:
        token = actions.create_invitation(session, "viewer")
        (invitation,) = queries.open_invitations(session)
        actions.withdraw_invitation(session, invitation.token_hash, "Ana")
        for link in (token, "made-up", ""):
            with pytest.raises(NotFound):
                actions.accept_invitation(session, link, "Bojan", PASSWORD)

    def test_an_old_link_does_not(self, session: Session) -> None:
        token = actions.create_invitation(session, "admin", "Ana")
        session.execute(update(Invitation).values(expires_at=func.now()))
        assert queries.open_invitation(session, token) is None
        assert queries.open_invitations(session) == []
        with pytest.raises(NotFound, match="too old"):
            actions.accept_invitation(session, token, "Bojan", PASSWORD)

    def test_two_at_once_make_one_person(self, database: Database) -> None:
        with database.begin() as session:
            token = actions.create_invitation(session, "admin")
        made: list[str] = []

        def accept(name: str) -> None:
            try:
                with database.begin() as session:
                    actions.accept_invitation(session, token, name, PASSWORD)
                made.append(name)
            except NotFound:
                pass

        threads = [threading.Thread(target=accept, args=(name,)) for name in ("Ana", "Bojan")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(made) == 1


class TestTheLastAdministrator:
    def test_is_never_lost(self, session: Session) -> None:
        ana, bojan = add(session, "Ana", "admin"), add(session, "Bojan", "admin")
        actions.change_role(session, bojan.id, "viewer", "Ana")
        with pytest.raises(Conflict, match="only administrator"):
            actions.disable_person(session, ana.id, "Ana")
        with pytest.raises(Conflict, match="only administrator"):
            actions.change_role(session, ana.id, "engineer", "Ana")
        actions.change_role(session, ana.id, "admin", "Ana")  # what changes nothing is no danger
        actions.disable_person(session, bojan.id, "Ana")

    def test_two_who_remove_each_other_at_once(self, database: Database) -> None:
        with database.begin() as session:
            ids = [add(session, name, "admin").id for name in ("Ana", "Bojan")]
        outcomes: list[str] = []
        together = threading.Barrier(2)

        def remove(person_id: int) -> None:
            try:
                with database.begin() as session:
                    together.wait()
                    actions.disable_person(session, person_id, "tests")
                outcomes.append("done")
            except Conflict:
                outcomes.append("refused")

        threads = [threading.Thread(target=remove, args=(person_id,)) for person_id in ids]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(outcomes) == ["done", "refused"]


def test_a_new_password_needs_the_old_one(session: Session) -> None:
    person = add(session, "Ana")
    caller = Caller("person", "Ana", role="viewer", person_id=person.id)
    with pytest.raises(Invalid) as refused:
        actions.change_password(session, caller, "not it at all", "another good one", None)
    assert refused.value.errors[0].field == "old"
    actions.change_password(session, caller, PASSWORD, "another good one", None)
    actions.change_password(session, caller, "another good one", PASSWORD, None)


def test_the_right_password_forgets_the_wrong_ones(session: Session) -> None:
    person = add(session, "Ana")
    caller, token = (
        Caller("person", "Ana", role="viewer", person_id=person.id),
        begin_session(session, person.id, 12).token,
    )
    for _round in range(2):
        for _guess in range(actions.GUESSES - 1):
            with pytest.raises(Invalid):
                actions.check_password(session, caller, "not it at all", token, "old")
        assert actions.check_password(session, caller, PASSWORD, token, "old") is person
    assert queries.signed_in(session, token, {}) is not None


@pytest.fixture(scope="module")
def boss(server: Any) -> httpx.Client:
    server.person("Boss", "admin", PASSWORD)
    client: httpx.Client = server.client()
    assert client.post("/sign-in", data={"name": "Boss", "password": PASSWORD}).status_code == 303
    return client


class TestOverHttp:
    def csrf(self, client: httpx.Client) -> str:
        found = re.search(r'name="csrf" value="([^"]+)"', client.get("/account").text)
        assert found
        return found[1]

    def test_an_invitation_from_link_to_signed_in(self, server: Any, boss: httpx.Client) -> None:
        shown = boss.post("/setup/people/invitations", data={"role": "operator", "csrf": self.csrf(boss)})
        link = re.search(r"/invitation/[\w-]+", shown.text)
        assert link
        guest = server.client()
        assert "operator" in guest.get(link[0]).text
        wrong = guest.post(link[0], data={"name": "Vesna", "password": PASSWORD, "again": "other"})
        assert wrong.status_code == 422
        assert 'value="Vesna"' in wrong.text, "what was typed is still there"
        short = guest.post(link[0], data={"name": "Vesna", "password": "short", "again": "short"})
        assert "at least 10 characters" in short.text
        taken = guest.post(link[0], data={"name": "boss", "password": PASSWORD, "again": PASSWORD})
        assert taken.status_code == 409
        done = guest.post(link[0], data={"name": "Vesna", "password": PASSWORD, "again": PASSWORD})
        assert done.status_code == 303
        me = guest.get("/api/v1/people/me").json()
        assert (me["name"], me["role"]) == ("Vesna", "operator")
        assert server.client().get(link[0]).status_code == 404

    def test_ending_access_ends_every_session(self, server: Any, boss: httpx.Client) -> None:
        server.person("Dragan", "engineer", PASSWORD)
        theirs = server.client()
        theirs.post("/sign-in", data={"name": "Dragan", "password": PASSWORD})
        assert theirs.get("/api/v1/machines").status_code == 200
        api = server.client(server.key())
        person = next(one for one in api.get("/api/v1/people").json()["items"] if one["name"] == "Dragan")
        changed = api.patch(f"/api/v1/people/{person['id']}", json={"role": "viewer"})
        assert changed.json()["role"] == "viewer"
        assert theirs.get("/api/v1/audit").status_code == 403, "a role counts at once"
        ended = boss.post(f"/setup/people/{person['id']}/disable", data={"csrf": self.csrf(boss)})
        assert ended.headers["location"] == "/setup/people?done=disabled"
        assert theirs.get("/api/v1/machines").status_code == 401
        again = server.client().post("/sign-in", data={"name": "Dragan", "password": PASSWORD})
        assert again.status_code == 401
        assert api.patch(f"/api/v1/people/{person['id']}", json={"disabled": False}).json()["disabled_at"] is None

    def test_the_last_administrator_cannot_leave(self, boss: httpx.Client) -> None:
        me = boss.get("/api/v1/people/me").json()
        for what, data in (("disable", {}), ("role", {"role": "viewer"})):
            refused = boss.post(f"/setup/people/{me['id']}/{what}", data={"csrf": self.csrf(boss), **data})
            assert refused.status_code == 409
            assert "only administrator" in refused.text
        assert boss.get("/setup/people").status_code == 200

    def test_a_changed_password_signs_out_other_browsers(self, server: Any) -> None:
        server.person("Ema", "viewer", PASSWORD)
        here, there = server.client(), server.client()
        for client in (here, there):
            client.post("/sign-in", data={"name": "Ema", "password": PASSWORD})
        form = {
            "old": PASSWORD,
            "new": "battery horse correct",
            "again": "battery horse correct",
            "csrf": self.csrf(here),
        }
        assert here.post("/account/password", data=form | {"old": "wrong password"}).status_code == 422
        assert here.post("/account/password", data=form).headers["location"] == "/account?done=password"
        assert here.get("/account").status_code == 200
        assert there.get("/account").status_code == 303

    def test_a_forgotten_password(self, server: Any, boss: httpx.Client) -> None:
        server.person("Fata", "viewer", PASSWORD)
        theirs = server.client()
        theirs.post("/sign-in", data={"name": "Fata", "password": PASSWORD})
        number = next(
            one["id"]
            for one in server.client(server.key()).get("/api/v1/people").json()["items"]
            if one["name"] == "Fata"
        )
        shown = boss.post(f"/setup/people/{number}/password", data={"csrf": self.csrf(boss)})
        password = re.search(r"(?:[0-9a-f]{4}-){3}[0-9a-f]{4}", shown.text)
        assert password
        assert theirs.get("/account").status_code == 303, "signed out"
        for typed, status in ((PASSWORD, 401), (password[0], 303)):
            answer = server.client().post("/sign-in", data={"name": "Fata", "password": typed})
            assert answer.status_code == status

    @pytest.mark.parametrize("body", [{}, {"role": "king", "name": "x"}, {"name": "x"}, {"name": "", "role": "viewer"}])
    def test_bad_keys_are_refused(self, server: Any, body: dict[str, Any]) -> None:
        assert server.client(server.key()).post("/api/v1/keys", json=body).status_code == 422

    @pytest.mark.parametrize("body", [{"role": "king"}, {"disabled": "maybe"}, {"name": "x"}, [], None])
    def test_bad_changes_of_people_are_refused(self, server: Any, body: Any) -> None:
        client = server.client(server.key())
        server.person(unique("Changed"), "viewer", PASSWORD)
        person = client.get("/api/v1/people").json()["items"][0]
        assert client.patch(f"/api/v1/people/{person['id']}", json=body).status_code == 422
        assert client.get(f"/api/v1/people/{person['id']}").json() == person
