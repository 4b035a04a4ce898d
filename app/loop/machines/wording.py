"""The words of machines: their controls by name, and texts for them."""

from collections.abc import Callable
from typing import NamedTuple

from app.errors import NotFound
from app.language.i18n import _

CONTROLS = {"sinumerik": "Sinumerik", "fanuc": "Fanuc", "heidenhain": "Heidenhain"}


class Text(NamedTuple):
    """Program text for one control: the control, its name, the text, and the name of the file that it is fetched as."""

    control: str
    name: str
    text: str
    file: str


def texts_by_control(own: str, write: Callable[[str | None], str | None], what: str) -> list[Text]:
    """The text for each control: the machine's own first, then those that read program text.

    write: for the control that is named, None for the machine's own; gives None where a control cannot have it. what: the
    file's name without its ending.
    """
    written = [(own, write(None)), *((other, write(other)) for other in ("sinumerik", "fanuc") if other != own)]
    return [
        Text(control, CONTROLS.get(control) or _("To type in"), text, file_name(control, what))
        for control, text in written
        if text is not None
    ]


def no_such_offset(offset: str) -> NotFound:
    """Error for a work offset that the chosen control does not have."""
    return NotFound(
        _("{offset} is no work offset of this control.").format(offset=offset),
        _("Choose the control that has it."),
    )


def no_old_offset() -> NotFound:
    """Error where no old work offset is kept on the control."""
    return NotFound(
        _("There is no text that sets a work offset back: the text for this control keeps none."),
        _(
            "Texts for Sinumerik and Fanuc that set a work offset keep the old one. Note the old offset before you type a new one."
        ),
    )


def file_name(control: str, what: str) -> str:
    """A name for program text that the control and every file system take; with full stops only before its ending."""
    ending = {"sinumerik": "spf", "fanuc": "nc"}.get(control, "txt")
    return f"{what.replace('.', '-')}.{ending}"
