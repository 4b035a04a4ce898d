"""The words of machines: their controls by name, and texts for them."""

from collections.abc import Callable

from app.web.i18n import _

CONTROLS = {"sinumerik": "Sinumerik", "fanuc": "Fanuc", "heidenhain": "Heidenhain"}


def texts_by_control(own: str, write: Callable[[str | None], str | None]) -> list[tuple[str, str, str]]:
    """Control, its name, and what is written for it: the machine's own first, then those that read program text.

    write: for the control that is named, None for the machine's own; gives None where a control cannot have it.
    """
    written = [(own, write(None)), *((each, write(each)) for each in ("sinumerik", "fanuc") if each != own)]
    return [(control, CONTROLS.get(control) or _("To type in"), text) for control, text in written if text is not None]


def file_name(control: str, what: str) -> str:
    """A name for program text that the control and every file system take; with full stops only before its ending."""
    ending = {"sinumerik": "spf", "fanuc": "nc"}.get(control, "txt")
    return f"{what.replace('.', '-')}.{ending}"
