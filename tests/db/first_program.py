"""A database as the first published program left it: revision 0018, with the rows that this program has written."""

from pathlib import Path

import psycopg
from alembic import command

from app.db import migrate

ROWS = Path(__file__).with_suffix(".sql")
MACHINE_KEY = "inband_xuRe6ynNk1IG5cCi-CewWlYu1_mrDj7ziNiI8_jWCz8"
ADMIN_KEY = "inband_mC05p1HX2Jzuecpb_pPPZs1H43A8OhSiQSRsS0Ymhxs"
ANA = {"name": "Ana", "password": "correct horse battery"}


def make_first_program(url: str) -> None:
    """Put it in the place of whatever this database holds."""
    with psycopg.connect(url) as connection:
        connection.execute("DROP SCHEMA public CASCADE")
        connection.execute("CREATE SCHEMA public")
    move(url, "0100")
    with psycopg.connect(url) as connection:
        connection.execute(ROWS.read_bytes())
        connection.execute("UPDATE alembic_version SET version_num = %s", [migrate.SQUASHED])


def move(url: str, revision: str) -> None:
    """Up or down to a revision, as the command ``alembic`` does it."""
    with migrate.connected(url) as connection:
        now = migrate.current(url)
        (command.downgrade if now and now > revision else command.upgrade)(migrate.config(connection), revision)
