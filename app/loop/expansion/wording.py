"""Sentences about sizes at 20 °C."""

from app.core.temperature import HIGHEST, LOWEST, AtReference, Missing
from app.language.formatting import plain_um, short, um
from app.language.i18n import _


def at_20_words(found: AtReference | Missing) -> str:
    """The correction of a size at 20 °C with its uncertainty, or why a reading has none."""
    if isinstance(found, Missing):
        return {
            Missing.COEFFICIENT: _("No expansion coefficient is stated."),
            Missing.PART_TEMPERATURE: _("The temperature of the part was not sent."),
            Missing.MACHINE_TEMPERATURE: _("The temperature of the machine was not sent."),
            Missing.NOT_BELIEVED: _("The temperature cannot be true: {low} to {high} °C are believed.").format(
                low=short(LOWEST), high=short(HIGHEST)
            ),
        }[found]
    said = _("{correction} from the measured size, which the decision rests on.").format(
        correction=um(found.correction, 2)
    )
    if found.uncertainty is None:
        return said
    return f"{said} " + _("Uncertainty {u} (k = 2), from the uncertainties that are stated.").format(
        u=plain_um(2 * found.uncertainty, 2)
    )
