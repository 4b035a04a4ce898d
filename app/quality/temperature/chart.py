"""From a study to the values of its chart."""

from app.core.drift import Column, Drift
from app.quality.temperature.figures import TemperatureChart
from app.quality.temperature.queries import Study


def chart_of(study: Study) -> TemperatureChart | None:
    """Values of the figure; None where there is no result."""
    if not isinstance(study.drift, Drift):
        return None
    return TemperatureChart(
        study.current.characteristic.key,
        study.drift.temperature.tolist(),
        study.drift.apart.tolist(),
        study.drift.sequence.tolist(),
        study.drift.regression.effects.get(Column.TEMPERATURE.value),
        study.expected,
        study.of,
    )
