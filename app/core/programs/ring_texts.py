"""The programs of the ring as texts: which of them there are, and each by its key."""

from collections.abc import Sequence

from app.core.programs.ring_dialects import RingText
from app.core.programs.ring_fanuc import Fanuc
from app.core.programs.ring_haas import Haas
from app.core.programs.ring_settings import RingControl, RingSettings
from app.core.programs.ring_sinumerik import Sinumerik
from app.core.programs.ring_steps import programs

DIALECTS: dict[RingControl, type[Sinumerik | Fanuc]] = {
    RingControl.SINUMERIK: Sinumerik,
    RingControl.FANUC: Fanuc,
    RingControl.HAAS: Haas,
}


def texts(settings: RingSettings, comments: Sequence[str] = ()) -> list[RingText]:
    """Every text, in the order in which they go into the control; the last one holds the calls for the part program.

    comments: whose characteristic it is, for the calls.
    """
    return DIALECTS[settings.control](settings).texts(programs(settings), comments)


def joined(settings: RingSettings, chosen: Sequence[RingText]) -> str:
    """Several of them in one text."""
    return DIALECTS[settings.control](settings).joined(chosen)
