"""How alembic runs our migrations: from the program with a connection of its own (app.db.migrate), or from the command
``alembic`` with INBAND_DATABASE_URL."""

from alembic import context
from sqlalchemy import Connection

from app.db.base import whole_metadata
from app.db.migrate import connected, include_object
from app.settings import Settings


def run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=whole_metadata(),
        include_object=include_object,
        compare_server_default=True,
        transaction_per_migration=True,
    )
    with context.begin_transaction():
        context.run_migrations()


if (given := context.config.attributes.get("connection")) is not None:
    run(given)
else:
    url = Settings().database_url
    if url is None:
        raise SystemExit("alembic needs INBAND_DATABASE_URL; `inband migrate` migrates the embedded database")
    with connected(url) as own:
        run(own)
