"""Names of the components of a gauge study, for tables and charts alike."""

from app.core.spc.gauge.crossed import Study
from app.language.i18n import _


def components(found: Study) -> list[tuple[str, float]]:
    """Name and standard deviation of each component, the whole gauge first, the total last."""
    rows = [(_("Gauge R&R"), found.grr), (_("Repeatability"), found.equipment)]
    if found.operators > 1:
        rows.append((_("Reproducibility"), found.appraiser))
    if found.interaction is not None:
        rows.append((_("Interaction"), found.interaction))
    return [*rows, (_("Parts"), found.part), (_("Total"), found.total)]
