"""The configuration of a bridge for a machine, to be copied: what is known here is filled in, the rest says what it is.

Every text is a configuration that the bridge reads (`app.bridge.configuration`); tests/loop/connections holds that.
"""

from collections.abc import Sequence
from typing import NamedTuple

from app.language.i18n import _

_LOCATED = {
    "opcua": ('register = "wear_length_1"', "diameter"),
    "haas": ('register = "wear_diameter"', "diameter"),
    "heidenhain": ('register = "QR{number}"', "radius"),
    "mqtt": ('register = "wear_diameter"', "diameter"),
}
"""Kinds that write offsets: the register of a location, and what it holds as a rule."""
_OWN = {
    "opcua": """url = "opc.tcp://192.168.214.1:4840"
user = "inband"
password_file = "{machine}.password"
certificate = "inband-bridge.der"  # inband bridge certificate --folder . makes both
key = "inband-bridge.pem\"""",
    "haas": """address = "192.168.1.17"
port = 5051                 # setting 143""",
    "heidenhain": """address = "192.168.1.23"
port = 19000
readings = 'TNC:\\inband\\readings.txt'
corrections = 'TNC:\\inband\\corr.h'""",
    "mqtt": """host = "192.168.1.5"
username = "inband"
password_file = "{machine}.password\"""",
    "folder": """path = "/srv/{machine}"     # absolute; \\"C:/…\\" on Windows
format = "csv"
names = "*.csv"
zone = "{zone}"

[machine.{machine}.folder.columns]
characteristic = "Feature"  # headings of the file
measured = "Actual"
measured_at = "Date\"""",
    "dprnt": """connect = "192.168.1.17:4001"  # or serial = "/dev/ttyUSB0", baud = 4800, framing = "7E1\"""",
    "text": """connect = "192.168.1.17:4001"  # or serial = "/dev/ttyUSB0"
zone = "{zone}"
lines = ['^(?P<characteristic>\\S+) +(?P<measured>[-\\d.]+)']""",
}
_NUMBERED = ("opcua", "haas", "heidenhain", "dprnt")
"""Kinds whose programs name a characteristic by a number."""
KINDS = tuple(_OWN)


class Known(NamedTuple):
    """A machine as it is known here. characteristics: keys; tools: R10 of those that are corrected; zone: of the plant."""

    machine: str
    server: str
    characteristics: Sequence[str]
    tools: Sequence[int]
    zone: str


def kinds() -> list[tuple[str, str]]:
    """Kinds of bridge with what they connect."""
    return [
        ("opcua", _("SINUMERIK by OPC UA")),
        ("haas", _("Haas by its Q commands")),
        ("heidenhain", _("HEIDENHAIN TNC")),
        ("mqtt", _("MQTT broker")),
        ("folder", _("Folder with files: measuring machines")),
        ("dprnt", _("Printed lines (DPRNT)")),
        ("text", _("Text of a gauge or an interface")),
    ]


def configuration(kind: str, known: Known) -> str:
    """The file for a bridge of this kind, whole."""
    names = {"machine": known.machine, "zone": known.zone}
    located = _LOCATED.get(kind)
    keys = known.characteristics or ("KEY-OF-A-CHARACTERISTIC",)
    mapped = [f'{at if kind in _NUMBERED else f"NAME{at}"} = "{key}"' for at, key in enumerate(keys, 1)]
    parts = [
        f'[server]\nurl = "{known.server}"',
        '[store]\nfile = "inband-bridge.sqlite3"',
        f'[machine.{known.machine}]\nkind = "{kind}"\nunit = "mm"                 # what the control works in\n'
        f'secret_file = "{known.machine}.key"  # a key of this machine, in a file beside this one'
        + ("" if located else '\ncorrections = "none"'),
        f"[machine.{known.machine}.{kind}]\n" + _OWN[kind].format(**names).replace('\\"', '"'),
        f"[machine.{known.machine}.characteristics]  # number or name at the control = key here\n" + "\n".join(mapped),
    ]
    if located:
        register, holds = located
        parts += [
            f"[[machine.{known.machine}.location]]\ntool_memory = {number}             # R10\ntool = {number}                    # T\n"
            f'{"edge = 1" + chr(10) if kind == "opcua" else ""}{register.format(number=number)}\nholds = "{holds}"          # diameter, radius or length'
            for number in known.tools
        ]
    return "\n\n".join(parts) + "\n"
