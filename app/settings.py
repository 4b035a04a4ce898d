"""Settings of an installation. Every field is also an environment variable: ``port`` is ``INBAND_PORT``."""

import re
import ssl
from collections.abc import Callable
from datetime import date
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Annotated, Literal, Self
from urllib.parse import urlsplit
from zoneinfo import available_timezones

import platformdirs
from pydantic import AfterValidator, AliasChoices, Field, model_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from app import HOUSE


def _postgres_url(url: str) -> str:
    from psycopg import ProgrammingError  # late: a command that only says how it is used needs no driver
    from psycopg.conninfo import conninfo_to_dict

    scheme, separator, rest = url.partition("://")
    if not separator or scheme not in {"postgresql", "postgres", "postgresql+psycopg"}:
        raise ValueError(
            "must be a PostgreSQL address such as postgresql://inband:secret@db.example:5432/inband; "
            "Inband runs on PostgreSQL only"
        )
    # Whatever reads such an address takes the first @, / or # for the end of the password, and names the rest in its errors.
    parts = urlsplit(url)
    if parts.netloc.count("@") > 1 or "@" in parts.path or "@" in parts.fragment:
        raise ValueError(
            "holds an @, / or # that is taken for the end of the password: in user and password write @ as %40, / as %2F, "
            "# as %23"
        )
    # The address may hold a password: say what is wanted, never what was given.
    wrong = ValueError("is not a well-formed address; write postgresql://user:password@host:5432/database")
    try:
        parameters = {name: str(value) for name, value in conninfo_to_dict(f"postgresql://{rest}").items()}
    except ProgrammingError:
        raise wrong from None
    hosts = parameters.get("hostaddr", parameters.get("host", "")).split(",")
    ports = parameters.get("port", "5432").split(",")
    if any("@" in host for host in hosts):
        raise ValueError("has an @ in its password; write it as %40, and likewise : as %3A, / as %2F, % as %25")
    if any(mark in host for host in hosts for mark in " \t<>#?"):
        raise wrong
    if any(port and not (port.isdecimal() and 1 <= int(port) <= 65535) for port in ports):
        raise wrong
    if len(ports) not in {1, len(hosts)}:
        raise ValueError("needs as many ports as hosts, or one for all of them")
    if not parameters.get("dbname"):
        raise ValueError("names no database; write postgresql://user:password@host:5432/DATABASE")
    return url


def _private_folder(path: Path) -> Path:
    path = Path.absolute(path.expanduser())
    if path in {Path("/"), Path.home(), Path("/tmp"), HOUSE}:  # noqa: S108 - these are refused, not used
        raise ValueError(f"{path} is shared with other things; name a folder of its own, for example {path / 'inband'}")
    return path


def _origin(url: str) -> str:
    parts = urlsplit(url)
    if parts.scheme not in {"http", "https"} or not parts.hostname or parts.path.strip("/") or parts.query:
        raise ValueError("must be the address people type, without a path: https://inband.example")
    return url.rstrip("/")


def computer_timezone() -> str:
    """The name of this computer's time zone; UTC if it has none that is known by name."""
    from babel.localtime import get_localzone

    name = str(getattr(get_localzone(), "key", "UTC"))
    nameless = {"localtime", "Factory", "Etc/UTC", "Etc/UCT", "Etc/GMT"}
    return name if name in available_timezones() - nameless else "UTC"


def _timezone(name: str) -> str:
    if name not in available_timezones():
        raise ValueError(f"there is no time zone {name!r}; name it like Europe/Belgrade")
    return name


def _shifts(text: str) -> str:
    """Clock times at which shifts begin, `06:00,14:00,22:00`, in their order."""
    begins = [each.strip() for each in text.split(",")]
    if not all(re.fullmatch(r"([01]\d|2[0-3]):[0-5]\d", each) for each in begins) or begins != sorted(set(begins)):
        raise ValueError(
            f"{text!r} is no list of times; name when the shifts begin, in order, such as 06:00,14:00,22:00"
        )
    return ",".join(begins)


def _each(text: str, kind: Callable[[str], object], wrong: str) -> str:
    """The parts of a list, each of this kind, with commas between them."""
    parts = [each.strip() for each in text.split(",") if each.strip()]
    for part in parts:
        try:
            kind(part)
        except ValueError:
            raise ValueError(f"{part!r} is no {wrong}") from None
    return ",".join(parts)


def _networks(text: str) -> str:
    return _each(text, ip_network, "network; name it like 192.168.10.0/24")


def _authorities(path: Path) -> Path:
    try:
        ssl.create_default_context(cafile=str(path))
    except OSError as error:
        raise ValueError(f"holds no certificate of an authority (PEM): {error}") from None
    return path


def _dates(text: str) -> str:
    return _each(text, date.fromisoformat, "date; write it like 2026-12-24")


TAKEN_SCHEMAS = frozenset({"inband", "information_schema"})
"""The list of plants lies in the first."""


def _schema(name: str) -> str:
    if not re.fullmatch(r"[a-z_][a-z0-9_]{0,49}", name) or name.startswith("pg_") or name in TAKEN_SCHEMAS:
        raise ValueError(
            f"{name!r} cannot be the schema of a plant; take up to 50 small letters, digits and _, such as plant_north, no digit "
            f"and no pg_ at the beginning, and not {' or '.join(sorted(TAKEN_SCHEMAS))}"
        )
    return name


def is_loopback(host: str) -> bool:
    """Tell if only programs on this computer reach ``host``."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def variable_of(field: str) -> str:
    """Name of the environment variable of a setting."""
    return f"INBAND_{'SCHEMA' if field == 'schema_name' else field.upper()}"


class Settings(BaseSettings):
    """Taken from arguments first, then from the environment; what is unsafe or senseless is refused in words."""

    model_config = SettingsConfigDict(
        env_prefix="INBAND_", frozen=True, env_ignore_empty=True, hide_input_in_errors=True
    )

    database_url: Annotated[str, AfterValidator(_postgres_url)] | None = Field(
        default=None,
        repr=False,
        description="A PostgreSQL server of your own. Without it Inband starts its own in data_dir.",
    )
    schema_name: Annotated[str, AfterValidator(_schema)] | None = Field(
        default=None,
        validation_alias=AliasChoices("schema_name", "INBAND_SCHEMA"),  # `schema` is a word of pydantic's own
        description="Schema of the database in which the tables of this plant lie: one database holds several plants. Without "
        "it the first of the role's search path, usually public.",
    )
    read_database_url: Annotated[str, AfterValidator(_postgres_url)] | None = Field(
        default=None,
        repr=False,
        description="A standby of that server, for charts, reports, exports and searches. Without it they read the server itself.",
    )
    read_most_behind: float = Field(
        default=10.0,
        ge=0.5,
        le=3600,
        description="Seconds that the standby may be behind; beyond that, charts and reports read the server itself.",
    )
    data_dir: Annotated[Path, AfterValidator(_private_folder)] = Field(
        default_factory=lambda: platformdirs.user_data_path("inband"),
        description="Where Inband keeps what it stores, the embedded PostgreSQL included.",
    )
    postgres_bin: Path | None = Field(
        default=None,
        description="Folder of PostgreSQL's programs for the embedded server. Without it those of the wheel, or newer ones of "
        "the same major release that the system offers.",
    )
    host: str = Field(default="127.0.0.1", min_length=1, description="Address to listen on.")
    port: int = Field(default=8000, ge=1, le=65535, description="Port to listen on.")
    workers: int = Field(default=1, ge=1, le=32, description="Server processes; one is enough for most plants.")
    public_url: Annotated[str, AfterValidator(_origin)] | None = Field(
        default=None,
        description="The address people type when a proxy is in front of Inband; https makes cookies Secure.",
    )
    allow_plain_http: bool = Field(
        default=False, description="Listen beyond this computer without https: passwords and keys travel readable."
    )
    forwarded_allow_ips: str = Field(
        default="127.0.0.1", description="Proxies whose X-Forwarded-* headers are believed, comma-separated."
    )
    pool_size: int = Field(
        default=10, ge=1, le=200, description="Database connections kept open per process for pages and programs."
    )
    pool_overflow: int | None = Field(
        default=None, ge=0, le=200, description="How many more there may be at once; as many again if left out."
    )
    door_pool_size: int = Field(
        default=8,
        ge=1,
        le=100,
        description="Database connections per process for machines alone: their readings, corrections and heartbeats, and who "
        "calls.",
    )
    timezone: Annotated[str, AfterValidator(_timezone)] = Field(
        default_factory=computer_timezone,
        description="Time zone of the plant, such as Europe/Belgrade: pages, charts, reports and files have its times.",
    )
    shifts: Annotated[str, AfterValidator(_shifts)] = Field(
        default="06:00,14:00,22:00",
        description="When the shifts of the plant begin, by its clock: for the period *this shift*.",
    )
    database_patience: float = Field(
        default=5.0,
        ge=1,
        le=60,
        description="Seconds that a request waits for a database that does not answer, before it gets 503.",
    )
    rotary_words: Path | None = Field(
        default=None,
        description="File (TOML) with words of the protocols of rotary axes, beside those that Inband knows.",
    )
    session_hours: int = Field(default=12, ge=1, le=24 * 31, description="Hours until a browser must sign in again.")

    bridge_silent_after: float = Field(
        default=60.0,
        ge=10,
        le=86_400,
        description="Seconds without a heartbeat after which a bridge counts as silent; the alarm comes within the next two minutes.",
    )
    bridge_backlog_after: float = Field(
        default=300.0,
        ge=10,
        le=86_400 * 7,
        description="Seconds that the oldest reading may wait in a bridge before it counts as backing up.",
    )

    corrections_taken_within: float = Field(
        default=1800.0,
        ge=60,
        le=86_400 * 7,
        description="Seconds in which a machine that cuts parts has to take a correction before an alarm says that it does not.",
    )
    corrections_not_taken_most: int = Field(
        default=5,
        ge=2,
        le=1000,
        description="Corrections of one characteristic that a machine may leave behind before that alarm, for five minutes.",
    )

    mail_server: Annotated[str, Field(pattern=r"^[A-Za-z0-9.-]+(:[0-9]{1,5})?$")] | None = Field(
        default=None,
        description="Mail server for notifications, such as mail.example:587. Without it no mail is sent.",
    )
    mail_security: Literal["starttls", "tls", "none"] = Field(
        default="starttls",
        description="Encryption to the mail server: starttls, tls from the first byte, or none, for one on this computer.",
    )
    mail_user: str | None = Field(
        default=None, description="User at the mail server; without it nobody signs in there."
    )
    mail_password: str | None = Field(default=None, repr=False, description="Its password.")
    mail_from: Annotated[str, Field(pattern=r"^[^@\s<>]+@[^@\s<>]+$")] | None = Field(
        default=None, description="Sender of the mails; inband@ and the name of the mail server if left out."
    )
    ca_file: Annotated[Path, AfterValidator(_authorities)] | None = Field(
        default=None,
        description="File with the certificates (PEM) of authorities of your own, trusted beside those of the computer: for the mail "
        "server and webhooks.",
    )
    webhook_networks: Annotated[str, AfterValidator(_networks)] = Field(
        default="",
        description="Networks inside which webhooks may lead, such as 192.168.10.0/24, comma-separated. Without it they lead to "
        "public addresses only, by https.",
    )
    allow_apprise: bool = Field(
        default=False,
        description="Let administrators send notifications by apprise, which connects to any address, inside the network too.",
    )
    days_off: Annotated[str, AfterValidator(_dates)] = Field(
        default="",
        description="Days on which the plant does not work, such as 2026-12-24,2026-12-31: for notifications, beside those of Set-up.",
    )

    part_cost: float | None = Field(
        default=None, gt=0, le=1e9, description="Cost of a rejected part: the ledger counts in money then."
    )
    currency: str = Field(default="EUR", pattern="^[A-Z]{3}$", description="Currency of INBAND_PART_COST, such as EUR.")

    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="The least that is logged: debug, info, warning or error."
    )
    log_format: Literal["text", "json"] = Field(
        default="text", description="How the log is written: text, or json for programs that collect it."
    )
    slow_request: float = Field(
        default=1.0, gt=0, le=3600, description="Seconds from which a request is logged as slow."
    )

    @model_validator(mode="after")
    def _nobody_listens_in(self) -> Self:
        if is_loopback(self.host) or self.allow_plain_http or self.secure_cookies:
            return self
        raise ValueError(
            f"host {self.host} is reached from other computers, where passwords and keys would travel readable. "
            "Put a proxy with https before Inband and name its address in INBAND_PUBLIC_URL=https://..., "
            "or accept the risk on a closed network with INBAND_ALLOW_PLAIN_HTTP=true"
        )

    @property
    def secure_cookies(self) -> bool:
        """Cookies are for https only, because people come by https."""
        return self.public_url is not None and self.public_url.startswith("https://")

    @property
    def address(self) -> str:
        """Address that a person types to get here."""
        if self.public_url:
            return self.public_url
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{'127.0.0.1' if host in {'0.0.0.0', '[::]'} else host}:{self.port}"  # noqa: S104 - compared only
