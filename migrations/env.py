"""How alembic runs our migrations: from the program with a connection of its own (app.db.migrate), or from the command
``alembic`` with INBAND_DATABASE_URL."""

from alembic import context
from sqlalchemy import Connection, NullPool, create_engine

from app.db.base import whole_metadata
from app.db.engine import psycopg_url
from app.db.migrate import OPTIONS, include_object
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
    engine = create_engine(psycopg_url(url), poolclass=NullPool, connect_args={"options": OPTIONS})
    with engine.connect() as own:
        run(own)
