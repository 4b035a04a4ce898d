"""The contents of help: which document stands under which heading."""

from collections.abc import Sequence
from typing import NamedTuple

from app.language.i18n import _
from app.views.help.queries import HELP, documents


class Group(NamedTuple):
    """Documents under a heading: address and title of each. folded: for those who develop Inband."""

    title: str
    documents: Sequence[tuple[str, str]]
    folded: bool = False


def groups() -> list[Group]:
    """All documents, each once."""
    how_to = [
        (
            _("On the shop floor"),
            "acknowledge-alarms control-plan reaction-plans quarantine stations sizes-by-hand approve-corrections change-tools notifications shift wall-screen alarm-load connections",
        ),
        (
            _("Set up"),
            "set-up-a-characteristic measuring-variants program-text connect-a-machine import-readings aqdef",
        ),
        (
            _("Judge a process"),
            "move-in-a-chart capability context control-charts run-rules shadow-trial what-if ledger read-the-wear-curve temperature gauge-studies reports",
        ),
        (_("Probe and align"), "calibrate work-zero alignment form rotary-axes"),
        (
            _("Connect machines"),
            "bridge bridge-opcua bridge-heidenhain bridge-haas bridge-dprnt bridge-mqtt bridge-mtconnect bridge-text bridge-folder ring-programs python-client",
        ),
        (_("Run the server"), "run-for-real back-up upgrade plants high-availability citus"),
    ]
    listed = [Group(title, [_entry(f"how-to/{name}") for name in names.split()]) for title, names in how_to]
    listed.append(Group(_("Look up"), [_entry(name) for name in documents() if name.startswith("reference/")]))
    decisions = [_entry(name) for name in documents() if name.startswith("decisions/")]
    return [*listed, Group(_("Why Inband is as it is"), decisions, folded=True)]


def _entry(name: str) -> tuple[str, str]:
    return f"{HELP}/{name}", documents()[name]
