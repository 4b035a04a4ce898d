"""The real cost of a password, which all other tests leave out: where it comes from, and that a real server has it."""

import ast
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from pwdlib import PasswordHash
from sqlalchemy import select

from app import HOUSE
from app.access import passwords
from app.access.tables import Person
from app.memory import NICE
from app.settings import Settings
from tests.servers import RunServer
from tests.shop import PASSWORD

LEAST_MEMORY = 64 * 1024  # KiB
LEAST_ROUNDS = 3


@dataclass(frozen=True)
class Cost:
    """What a hash took to make, as it says itself."""

    memory: int
    rounds: int

    @classmethod
    def of(cls, password_hash: str) -> "Cost":
        found = re.match(r"\$argon2id\$v=19\$m=(\d+),t=(\d+),p=\d+\$", password_hash)
        assert found is not None, password_hash
        return cls(int(found[1]), int(found[2]))

    @property
    def is_enough(self) -> bool:
        return self.memory >= LEAST_MEMORY and self.rounds >= LEAST_ROUNDS


TEMPTING = {
    "INBAND_PASSWORD_COST": "1",
    "INBAND_ARGON2_MEMORY_COST": "8",
    "INBAND_TEST": "1",
    "INBAND_DEBUG": "1",
    "INBAND_DEMO": "true",
    "INBAND_ENVIRONMENT": "test",
    "TESTING": "1",
    "ENV": "test",
}
"""What somebody might try, or another program might read."""


def test_the_recommended_cost_is_enough() -> None:
    assert Cost.of(PasswordHash.recommended().hash(PASSWORD)).is_enough


def test_these_tests_have_a_cheap_one() -> None:
    """Else the tests below would say nothing."""
    assert not Cost.of(passwords.hashed(PASSWORD)).is_enough


def test_a_program_has_the_recommended_cost_in_the_environment_of_the_tests() -> None:
    program = (
        "import hashlib\n"
        "from app.access.passwords import hashed, looked_up, matches\n"
        "real, costs = hashlib.scrypt, []\n"
        "hashlib.scrypt = lambda *words, **cost: costs.append(cost['n'] * cost['r']) or real(*words, **cost)\n"
        "looked_up('badge')\n"
        f"made = hashed({PASSWORD!r})\n"
        f"print(made, matches({PASSWORD!r}, made), *costs)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=HOUSE,
        env=os.environ | TEMPTING,
        capture_output=True,
        text=True,
        check=True,
    )
    made, right, cost = done.stdout.split()
    assert int(cost) >= 2**15 * 8, "of a code, such as a badge"
    assert Cost.of(made) == Cost.of(PasswordHash.recommended().hash(PASSWORD))
    assert right == "True"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a thread has the priority of its process")
def test_readings_go_before_those_who_guess(monkeypatch: pytest.MonkeyPatch) -> None:
    class Asked:
        @staticmethod
        def hash(_password: str) -> str:
            return str(os.getpriority(os.PRIO_PROCESS, 0))

    monkeypatch.setattr(passwords, "_hashing", Asked)
    own = os.getpriority(os.PRIO_PROCESS, 0)
    assert int(passwords.hashed(PASSWORD)) == min(own + NICE, 19)
    assert os.getpriority(os.PRIO_PROCESS, 0) == own, "the caller goes on as before"


def test_nothing_in_the_program_sets_another_cost() -> None:
    """It is a constant of its module, which reads neither settings nor environment, and no other module touches it."""
    assert not [name for name in Settings.model_fields if re.search("hash|argon|password_cost|rounds", name)]
    own = Path(passwords.__file__)
    nodes = list(ast.walk(ast.parse(own.read_text())))
    imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    assert not imported & {"os", "sys", "builtins", "importlib", "app.settings"}
    stored = [node for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    names = [node.id for node in stored]
    assert (names.count("_hashing"), names.count("_code_cost")) == (1, 1)
    assert "\n_hashing = PasswordHash.recommended()\n_code_cost = 2**15 " in own.read_text()
    others = [file for file in (HOUSE / "app").rglob("*.py") if file != own]
    assert [
        file.name for file in others if re.search(r"pwdlib|argon2|passwords\._|_hashing|_code_cost", file.read_text())
    ] == []


def test_a_server_that_runs_as_a_program_has_it_and_people_sign_in(
    run_server: RunServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in TEMPTING.items():
        monkeypatch.setenv(name, value)
    with run_server(forked=False) as server:
        made = server.client(server.key()).post("/api/v1/people/invitations", json={"role": "viewer"})
        invitation = urlsplit(made.json()["url"]).path
        typed = {"name": "Vesna", "password": PASSWORD, "again": PASSWORD}
        assert server.client().post(invitation, data=typed).status_code == 303
        with server.database.begin() as session:
            stored = session.scalars(select(Person.password_hash)).one()
        assert Cost.of(stored).is_enough
        for password, status in (("wrong horse battery", 401), (PASSWORD, 303)):
            answer = server.client().post("/sign-in", data={"name": "Vesna", "password": password})
            assert answer.status_code == status, answer.text
