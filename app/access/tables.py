"""People, their browser sessions, invitations, failed sign-ins, known places and badges; API keys; devices bound to machines."""

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, Identity, Index, LargeBinary, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

ROLES = ("viewer", "operator", "engineer", "admin")
_ROLE_CHECK = "role IN ('viewer', 'operator', 'engineer', 'admin')"


class Person(Base):
    """A person who signs in. Disabled people stay, because the record names them."""

    __tablename__ = "person"
    __table_args__ = (
        CheckConstraint(_ROLE_CHECK, name="role"),
        # One name in any spelling of upper and lower case.
        Index("person_name_key", text("lower(name)"), unique=True),
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    name: Mapped[str]
    role: Mapped[str]
    password_hash: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    disabled_at: Mapped[datetime | None]
    pin_hash: Mapped[str | None]  # what they identify themselves with at a station


class BrowserSession(Base):
    """A signed-in browser. The cookie holds the token, the table only its SHA-256."""

    __tablename__ = "browser_session"

    token_hash: Mapped[bytes] = mapped_column(LargeBinary, primary_key=True)
    person_id: Mapped[int] = mapped_column(ForeignKey("person.id"), index=True)
    csrf: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    expires_at: Mapped[datetime]
    wrong_passwords: Mapped[int] = mapped_column(server_default="0")  # tries to change the password without knowing it


class Invitation(Base):
    """A one-time link with which a person chooses a name and a password."""

    __tablename__ = "invitation"
    __table_args__ = (CheckConstraint(_ROLE_CHECK, name="role"),)

    token_hash: Mapped[bytes] = mapped_column(LargeBinary, primary_key=True)
    role: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    expires_at: Mapped[datetime]
    used_at: Mapped[datetime | None]


class LoginFailure(Base):
    """A sign-in that failed; too many of them slow the next one down."""

    __tablename__ = "login_failure"
    __table_args__ = (Index("login_failure_at_idx", "at"),)

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    name: Mapped[str]
    address: Mapped[str]  # the place it came from, as in `KnownPlace`
    at: Mapped[datetime] = mapped_column(server_default=func.now())


class KnownPlace(Base):
    """A place that a person has signed in from: an address, or a browser by its cookie (`device ` and the SHA-256 of its token).

    From there strangers who guess the password elsewhere keep nobody out.
    """

    __tablename__ = "known_place"

    person_id: Mapped[int] = mapped_column(ForeignKey("person.id"), primary_key=True)
    place: Mapped[str] = mapped_column(primary_key=True)
    last_at: Mapped[datetime] = mapped_column(server_default=func.now())


class ApiKey(Base):
    """A secret that programs call with: a machine's own, or one with a person's role."""

    __tablename__ = "api_key"
    __table_args__ = (
        CheckConstraint("(role IS NULL) <> (machine_id IS NULL)", name="role_or_machine"),
        CheckConstraint(f"role IS NULL OR {_ROLE_CHECK}", name="role"),
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    secret_hash: Mapped[bytes] = mapped_column(LargeBinary, unique=True)
    name: Mapped[str]
    role: Mapped[str | None]
    machine_id: Mapped[int | None] = mapped_column(ForeignKey("machine.id"), index=True)
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    last_used_at: Mapped[datetime | None]  # to the minute
    revoked_at: Mapped[datetime | None]


class StationDevice(Base):
    """A tablet bound to one machine: it shows the machine's station and does nothing by itself.

    Bound by a one-time code; from then on its cookie holds the token. The table has only the SHA-256 of either.
    """

    __tablename__ = "station_device"
    __table_args__ = (CheckConstraint("(code_hash IS NULL) <> (token_hash IS NULL)", name="code_or_token"),)

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), index=True)
    name: Mapped[str]
    code_hash: Mapped[bytes | None] = mapped_column(LargeBinary, unique=True)
    token_hash: Mapped[bytes | None] = mapped_column(LargeBinary, unique=True)
    csrf: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    bound_at: Mapped[datetime | None]
    last_used_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]


class Badge(Base):
    """A badge that is scanned at a station. Its code is looked up by a hash that is slow to compute."""

    __tablename__ = "badge"

    code_hash: Mapped[bytes] = mapped_column(LargeBinary, primary_key=True)
    person_id: Mapped[int] = mapped_column(ForeignKey("person.id"), index=True)
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())


class WallScreen(Base):
    """A screen on the wall: the SHA-256 of the key that opens it, and nothing else."""

    __tablename__ = "wall_screen"

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True)
    secret_hash: Mapped[bytes] = mapped_column(LargeBinary, unique=True)
    name: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(server_default=func.now())
    created_by: Mapped[str]
    last_used_at: Mapped[datetime | None]  # to the minute
    revoked_at: Mapped[datetime | None]
