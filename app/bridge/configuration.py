"""The configuration: one TOML file. Every mistake is said with its place and what to do, all of them at once."""

import hashlib
import json
import os
import re
import ssl
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from app.bridge.kinds import KindError, kind_named, mtconnect
from app.core.ring import INCH

KEY = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")
Positive = Annotated[float, Meta(gt=0)]
Number = Annotated[int, Meta(ge=1)]
LONGEST_HEARTBEAT = 30.0  # s
T = TypeVar("T")
MISSING = {
    "unit": ': "mm" or "inch", what the control works in',
    "url": ": the address, such as https://inband.plant.example or opc.tcp://192.168.214.1:4840",
    "address": ": name or number of the control in the network",
    "holds": ': what the register holds, "diameter", "radius" or "length"',
    "register": ": the kind's word for the offset, such as wear_length_1 or wear_diameter",
}


class ConfigurationError(ValueError):
    """The file cannot be used. problems: one sentence each, with the place."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class Location(Struct, forbid_unknown_fields=True, frozen=True):
    """One tool memory R10 of Inband, and the register of the control that it stands for: the whole mapping in one place.

    holds: whether the register holds a diameter or a radius, as the control shows it; a radius is half of Inband's offset.
    sign: −1 if the register counts against Inband's offset. register: the kind's word for the offset, such as
    ``wear_length_1`` or ``wear_radius``. factor: of Inband's offset, for what the others cannot say.
    """

    tool_memory: Number
    tool: Number
    register: str
    holds: Literal["diameter", "radius", "length"]
    edge: Number = 1
    sign: Literal[1, -1] = 1
    factor: Positive = 1.0
    largest_step: Positive | None = None

    def to_control(self, offset: float, unit: str) -> float:
        """Inband's offset (mm) as the register holds it."""
        return offset * self._scale(unit)

    def from_control(self, value: float, unit: str) -> float:
        """The number in the register as Inband's offset, mm."""
        return value / self._scale(unit)

    def _scale(self, unit: str) -> float:
        halved = 0.5 if self.holds == "radius" else 1.0
        return self.sign * self.factor * halved / (INCH if unit == "inch" else 1.0)


class Machine(Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """One machine. Times in seconds, lengths in mm.

    identity: what the control must answer as its serial number. corrections: the control takes them from the mailbox
    (``control``), the bridge writes the offset itself (``direct``), or there are ``none``. proof_needed: corrections wait
    until a touch test has proved the mapping of their location. offsets_every: how often offsets are read, which is how an edit
    at the panel is noticed. touch_tests_by_page: a person in the browser may have an offset changed by the amount of a touch
    test, besides the command at this computer. patience: how long one call to the control may take. context: an MTConnect agent that tells the part
    of readings that have none.
    """

    key: str
    kind: str
    unit: Literal["mm", "inch"]
    secret: str
    settings: Any
    identity: str | None = None
    corrections: Literal["control", "direct", "none"] = "control"
    characteristics: dict[str, str] = {}
    location: tuple[Location, ...] = ()
    interval: Positive = 0.25
    offsets_every: Positive = 10.0
    patience: Positive = 10.0
    tolerance: Positive = 0.0005
    largest_step: Positive = 0.1
    largest_distance: Positive = 0.5
    largest_age: Positive = 8 * 3600.0
    proof_needed: bool = True
    touch_tests_by_page: bool = False
    context: mtconnect.Settings | None = None

    def mapping_hash(self, location: Location | None = None) -> str:
        """The hash of the mapping of one location, or of all: it changes with everything that a number's meaning depends on."""
        content = {
            "kind": self.kind,
            "unit": self.unit,
            "identity": self.identity,
            "place": [str(getattr(self.settings, name)) for name in getattr(kind_named(self.kind), "MEANING", ())],
            "characteristics": {} if location else self.characteristics,
            "locations": [
                {name: value for name, value in msgspec.structs.asdict(place).items() if name != "largest_step"}
                for place in ((location,) if location else self.location)
            ],
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


class Server(Struct, forbid_unknown_fields=True, frozen=True):
    """The server. ca: a file with the certificate of the authority that signed the server's, if it is one of the plant's own.

    ask: how often corrections are asked for that no reading has announced, s. heartbeat: s between two, `LONGEST_HEARTBEAT` at most;
    the server counts a minute without one as a pause of the machine, and a bridge as silent.
    """

    url: str
    ca: str | None = None
    ask: Positive = 5.0
    heartbeat: Positive = 10.0


class Store(Struct, forbid_unknown_fields=True, frozen=True):
    """The store. keep: how long readings that the server has are kept, hours. largest: size that it may have, MB."""

    file: str = "inband-bridge.sqlite3"
    keep: Positive = 48.0
    largest: Positive = 500.0


class Configuration(Struct, frozen=True):
    """Everything that the file says. warnings: sentences about what is not kept as it says."""

    server: Server
    store: Store
    machines: tuple[Machine, ...]
    hold_all: bool = False
    warnings: tuple[str, ...] = ()


def read_configuration(path: Path) -> Configuration:
    """The configuration in a file. Relative files are beside it.

    Raises `ConfigurationError` with every mistake.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError([f"{path} cannot be read: {error.strerror}."]) from error
    except UnicodeDecodeError as error:
        raise ConfigurationError([f"{path} is not UTF-8 at byte {error.start}: save it as UTF-8."]) from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError([f"{path} is not TOML: {error}."]) from error
    return configuration_from(content, path.parent)


def configuration_from(content: dict[str, Any], folder: Path) -> Configuration:
    """The configuration from the tables of a TOML file; ``folder`` is where relative files stand.

    Raises `ConfigurationError` with every mistake.
    """
    problems = [
        f"[{name}] is not known; known are [server], [store], [machine.KEY] and hold_all."
        for name in content.keys() - {"server", "store", "machine", "hold_all"}
    ]
    server = _converted(content.get("server", {}), Server, "server", problems)
    store = _converted(content.get("store", {}), Store, "store", problems)
    if server is not None and not re.match(r"https?://[^/]", server.url):
        problems.append(f"server.url = {server.url!r} is not an address such as https://inband.plant.example.")
    tables = content.get("machine", {})
    if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
        problems.append("Machines are tables with their key: [machine.lathe-1].")
        tables = {}
    if not tables:
        problems.append("No machine: add a table such as [machine.lathe-1].")
    machines = [machine for key, table in tables.items() if (machine := _machine(key, table, folder, problems))]
    problems += _shared_secrets(machines)
    if problems or server is None or store is None:
        raise ConfigurationError(problems)
    placed = msgspec.structs.replace(store, file=str(folder / store.file))
    certificate = None if server.ca is None else str(folder / server.ca)
    if certificate is not None and (reason := _not_trusted(certificate)):
        raise ConfigurationError([f"server.ca: {certificate} {reason}"])
    warnings = []
    if server.heartbeat > LONGEST_HEARTBEAT:
        longest = f"{LONGEST_HEARTBEAT:g}"
        words = (
            f"server.heartbeat = {server.heartbeat:g} is more than {longest}: one is sent every {longest} s, for the server takes a"
            " bridge for silent after a minute. Set a smaller number, or none."
        )
        warnings.append(words)
    server = msgspec.structs.replace(server, ca=certificate, heartbeat=min(server.heartbeat, LONGEST_HEARTBEAT))
    return Configuration(server, placed, tuple(machines), bool(content.get("hold_all", False)), tuple(warnings))


def _machine(key: str, table: dict[str, Any], folder: Path, problems: list[str]) -> Machine | None:
    place = f"machine.{key}"
    before = len(problems)
    if not KEY.fullmatch(key):
        problems.append(f"[{place}]: {key!r} is not the key of a machine (small letters, digits, “.”, “_”, “-”).")
    table = dict(table)
    kind = table.get("kind")
    settings: Any = None
    if not isinstance(kind, str):
        problems.append(f'{place}.kind is missing: the kind of control, such as "opcua" or "haas".')
    else:
        try:
            module = kind_named(kind)
        except KindError as error:
            problems.append(f"{place}: {error}")
        else:
            settings = _converted(table.pop(kind, {}), module.Settings, f"{place}.{kind}", problems)
            if hasattr(settings, "beside"):  # a kind with files of its own, which are beside the configuration
                settings = settings.beside(folder, f"{place}.{kind}", problems)
    secret = _secret(table, place, folder, problems)
    machine = _converted(table | {"key": key, "secret": secret or "", "settings": settings}, Machine, place, problems)
    if machine is not None:
        problems += _contradictions(machine, place)
    return machine if len(problems) == before else None


def _secret(table: dict[str, Any], place: str, folder: Path, problems: list[str]) -> str | None:
    """The machine's key for the server: written out, in a file, or in a variable of the environment."""
    given: dict[str, Any] = {name: table.pop(name) for name in ("secret", "secret_file", "secret_env") if name in table}
    if len(given) != 1 or not all(isinstance(value, str) for value in given.values()):
        problems.append(
            f"{place} needs one of secret, secret_file and secret_env: the key of the machine that Inband showed once"
            " (Set-up, Machines, the machine, Make key)."
        )
        return None
    [(name, value)] = given.items()
    value = str(value)
    if name == "secret_env":
        found = os.environ.get(value)
        if not found:
            problems.append(f"{place}.secret_env: the variable {value} is not set.")
            return None
        value = found
    if name == "secret_file":
        try:
            value = (folder / value).read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            problems.append(f"{place}.secret_file: {folder / value} cannot be read: {error}.")
            return None
    if not value.isascii() or not value.isprintable() or " " in value or not value:
        problems.append(f"{place}.{name} holds no key: one is a single word of plain letters, as Inband has shown it.")
        return None
    return value


def _contradictions(machine: Machine, place: str) -> Iterator[str]:
    if machine.context is not None and not re.match(r"https?://[^/]", machine.context.url):
        yield f"{place}.context.url = {machine.context.url!r} is not an address such as http://192.168.1.20:5000."
    for number in machine.characteristics:
        if not number.isdecimal() and getattr(kind_named(machine.kind), "NUMBERED", False):
            yield f"{place}.characteristics: {number!r} is not a number as the NC program writes it."
    for key in machine.characteristics.values():
        if not KEY.fullmatch(key):
            yield f"{place}.characteristics: {key!r} is not the key of a characteristic."
    memories = [location.tool_memory for location in machine.location]
    for memory in sorted({memory for memory in memories if memories.count(memory) > 1}):
        yield f"{place}: tool memory {memory} has several locations; one register holds one tool memory."
    named = getattr(kind_named(machine.kind), "REGISTER_OF", ("tool", "edge"))
    registers = [
        " of ".join(filter(None, (at.register, ", ".join(f"{name} {getattr(at, name)}" for name in named))))
        for at in machine.location
    ]
    for register in sorted({each for each in registers if registers.count(each) > 1}):
        yield f"{place}: {register} covers several tool memories."
    if machine.corrections != "none" and not machine.location:
        yield (
            f"{place} takes corrections (corrections = {machine.corrections!r}) but has no location: add"
            f' [[{place}.location]], or set corrections = "none".'
        )
    if machine.largest_step > machine.largest_distance:
        yield f"{place}: largest_step {machine.largest_step:g} is more than largest_distance {machine.largest_distance:g}."


def _not_trusted(certificate: str) -> str | None:
    """The reason why a file holds no certificate of an authority."""
    try:
        ssl.create_default_context(cafile=certificate)
    except OSError as error:
        return f"cannot be read as a certificate (PEM): {error.strerror or error}."
    return None


def _shared_secrets(machines: list[Machine]) -> Iterator[str]:
    """A key belongs to one machine: the same one twice sends the readings of one as those of the other."""
    first: dict[str, str] = {}
    for machine in machines:
        other = first.setdefault(machine.secret, machine.key)
        if other != machine.key and machine.secret:
            yield f"machine.{machine.key} and machine.{other} have the same key for the server; each machine has its own."


def _converted(value: object, kind: type[T], place: str, problems: list[str]) -> T | None:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        problems.append(_sentence(str(error), place))
        return None


def _sentence(words: str, place: str) -> str:
    """A message of msgspec with the place in TOML's words."""
    message, _, where = words.partition(" - at `$")
    if unknown := re.search(r"unknown field `(\w+)`", message):
        path = f"{place}{where.rstrip('`')}.{unknown[1]}"
        return f"{path} is not known: look for a typing error."
    if missing := re.search(r"missing required field `(\w+)`", message):
        return f"{place}{where.rstrip('`')}.{missing[1]} is missing{MISSING.get(missing[1], '')}."
    if wrong := re.search(r"nvalid enum value (.*)", message):
        name = where.rstrip("`").rpartition(".")[2]
        return f"{place}{where.rstrip('`')} = {wrong[1]} is not possible{MISSING.get(name, '')}."
    return f"{place}{where.rstrip('`')}: {message}."
