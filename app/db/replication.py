"""Copies of the database on other servers, as PostgreSQL tells it: for `inband check`, which says what they are good for."""

from typing import NamedTuple

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database

_SERVER = text(
    "SELECT current_setting('synchronous_standby_names'), current_setting('synchronous_commit'), current_setting('fsync'),"
    " pg_has_role('pg_read_all_stats', 'USAGE')"
)
_STANDBYS = text(
    "SELECT coalesce(nullif(application_name, ''), client_addr::text, 'unnamed'), state, sync_state,"
    " extract(epoch FROM replay_lag)::float8 FROM pg_stat_replication"
    " WHERE application_name <> 'pg_basebackup' ORDER BY 1"
)
SYNCHRONOUS = ("sync", "quorum")


class Standby(NamedTuple):
    """A server that receives what this one writes. Its state is None where the role may not see it; the lag is in seconds."""

    name: str
    state: str | None
    sync_state: str | None
    lag: float | None

    @property
    def synchronous(self) -> bool:
        """Tell if commits wait for it."""
        return self.sync_state in SYNCHRONOUS and self.state == "streaming"


class Replication(NamedTuple):
    """The standbys of the server that is connected, and what a commit waits for."""

    names: str
    synchronous_commit: str
    fsync: bool
    visible: bool
    standbys: tuple[Standby, ...]


def replication_of(session: Session) -> Replication:
    """State of replication, as the server reports it. Reads only."""
    names, commit, fsync, visible = session.execute(_SERVER).one()
    standbys = tuple(Standby(*row) for row in session.execute(_STANDBYS))
    return Replication(names.strip(), commit, fsync == "on", visible, standbys)


class Lag(NamedTuple):
    """Lag of a replica, in bytes of the log; in_recovery: it is a standby."""

    bytes: int
    in_recovery: bool


def lag_of(written: Database, read: Database) -> Lag:
    """Lag of the copy that is read behind the server that is written to. Raises SQLAlchemy's `OperationalError`."""
    with written.begin() as session:
        place = session.scalar(text("SELECT pg_current_wal_flush_lsn()::text"))
    with read.begin() as session:
        replayed = "CASE WHEN pg_is_in_recovery() THEN pg_last_wal_replay_lsn() ELSE pg_current_wal_flush_lsn() END"
        behind, in_recovery = session.execute(
            text(f"SELECT (CAST(:place AS pg_lsn) - {replayed})::bigint, pg_is_in_recovery()"),
            {"place": place},
        ).one()
    return Lag(int(behind or 0), bool(in_recovery))


def advice_on(replication: Replication) -> list[str]:
    """Sentences about what an administrator should know or change; none where every answered reading is on two servers."""
    advice = []
    if not replication.fsync:
        advice.append("fsync is off: a power cut may destroy the whole database. Switch it on.")
    if replication.synchronous_commit == "off":
        advice.append(
            "synchronous_commit is off: readings are answered before they are on the disk, and a crash loses some. Set it on."
        )
    if not replication.visible and (replication.standbys or replication.names):
        advice.append(
            "This role may not see the state of standbys; GRANT pg_read_all_stats TO it, and this check says more."
        )
        return advice
    synchronous = [standby.name for standby in replication.standbys if standby.synchronous]
    if replication.names and not synchronous:
        advice.append(
            f"synchronous_standby_names is '{replication.names}' and no such standby is connected: whatever is to be stored "
            "waits for it and is answered 503. Bring the standby back, or take it out of the setting."
        )
    elif replication.names and replication.synchronous_commit == "local":
        advice.append(
            "synchronous_commit is local: commits do not wait for the standby, which may lack what was answered last."
        )
    elif replication.standbys and not synchronous:
        advice.append(
            "No standby is synchronous: one that is promoted may lack the readings that were answered last. "
            "synchronous_standby_names makes every commit wait until a standby has it: with two standbys, 'ANY 1 (a, b)' with "
            "their names lets either of them be down."
        )
    elif synchronous and len([standby for standby in replication.standbys if standby.state == "streaming"]) == 1:
        advice.append(
            "One standby is connected, and every commit waits for it: while it is unreachable, whatever is to be stored is answered "
            "503. With a second one, synchronous_standby_names 'ANY 1 (a, b)' with their names lets either of them be down."
        )
    return advice


def in_words(replication: Replication) -> str:
    """The standbys in one line."""
    if not replication.standbys:
        return "no standby is connected; everything is on this one server, and in your backups"
    if not replication.visible:
        return f"{len(replication.standbys)} standby(s) connected"
    return ", ".join(_one(standby) for standby in replication.standbys)


def _one(standby: Standby) -> str:
    kind = "synchronous" if standby.synchronous else f"asynchronous, {standby.state}"
    behind = "" if standby.lag is None else f", {standby.lag:.1f} s behind"
    return f"standby {standby.name}: {kind}{behind}"
