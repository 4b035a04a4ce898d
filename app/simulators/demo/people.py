"""People of the demonstration plant, its wall screen, and the key by which the plant sets itself up.

Passwords and the key of the wall screen are made up for each installation and kept, readable by its owner alone, beside the data
they open, so that a second start prints the same ones.
"""

import json
import os
import secrets
from pathlib import Path

from sqlalchemy.orm import Session

from app.access import actions, queries, screens
from app.access.callers import Caller
from app.db.engine import Database
from app.errors import InbandError
from app.language.i18n import _
from app.loop.machines import queries as machines
from app.loop.notifications import browser_actions
from app.settings import Settings
from app.simulators.demo import plant

PEOPLE = {"engineer": "engineer", "operator": "operator", "admin": "admin"}  # name and role
ACTOR = "inband demo"
WALL = "wall screen"
LETTERS = "abcdefghijkmnpqrstuvwxyz23456789"  # none that look alike


def file_of(settings: Settings) -> Path:
    """File that holds the passwords."""
    return settings.data_dir / "demo.json"


def sign_ins(database: Database, settings: Settings) -> dict[str, str]:
    """The people who may sign in, with their passwords; they are made at the first start.

    Raises `InbandError` on a database that holds a plant of the user's own.
    """
    path = file_of(settings)
    known = _kept(path)
    passwords: dict[str, str] = {}
    with database.begin() as session:
        _refuse_a_real_plant(session, settings, path)
        for name, role in PEOPLE.items():
            if queries.person_named(session, name) is None:
                passwords[name] = known.get(name) or _password()
                person = actions.add_person(session, name=name, role=role, password=passwords[name], actor=ACTOR)
                browser_actions.set_browser(session, Caller("person", name, person_id=person.id), settings)
            elif name in known:
                passwords[name] = known[name]
        kept = {name: known[name] for name in known.keys() - PEOPLE} | passwords
        if kept != known:
            _keep(path, kept)
    return passwords


def plant_key(database: Database) -> str:
    """A key for this run, with which the plant sets itself up through the API."""
    with database.begin() as session:
        for key in queries.role_keys(session, 0, 1000):
            if key.name == ACTOR and key.revoked_at is None:
                actions.revoke_key(session, key.id, ACTOR)
        return actions.add_key(session, name=ACTOR, role="admin", actor=ACTOR).secret


def wall_link(database: Database, settings: Settings) -> str:
    """The link of a wall screen: the same at each start, so that an open one goes on, until it is revoked."""
    path = file_of(settings)
    known = _kept(path)
    with database.begin() as session:
        if screens.screen_of(session, known.get(WALL, "")) is None:
            known[WALL] = screens.add_screen(session, ACTOR, ACTOR).key
            _keep(path, known)
    return f"{settings.address}/wall#{known[WALL]}"


def _refuse_a_real_plant(session: Session, settings: Settings, path: Path) -> None:
    present = {machine.key for machine in machines.machines(session)}
    own = {machine.key for machine in plant.MACHINES}
    if present and not (present & own and path.exists()):
        where = _("The database") if settings.database_url else str(settings.data_dir)
        raise InbandError(
            _("{where} holds a plant already, and the demonstration would mix its simulated readings into it.").format(
                where=where
            ),
            _(
                "Give the demonstration a folder of its own: inband demo --data-dir FOLDER. "
                "To serve what is there: inband serve"
            ),
        )


def _password() -> str:
    return "-".join("".join(secrets.choice(LETTERS) for _letter in range(4)) for _group in range(3))


def _kept(path: Path) -> dict[str, str]:
    kept: dict[str, str] = json.loads(path.read_text()) if path.exists() else {}
    return kept


def _keep(path: Path, secrets_now: dict[str, str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".new")
    with os.fdopen(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
        json.dump(secrets_now, file)
    draft.replace(path)
