"""From the wear curve as it is read to the one that is drawn."""

from app.quality.wear.figures import Life, WearChart
from app.quality.wear.queries import Curve, Wear


def chart_of(wear: Wear) -> WearChart:
    """Values of the wear figure."""
    parameters = wear.current.parameters
    return WearChart(
        key=wear.current.characteristic.key,
        now=_life(wear.now),
        lives=[_life(curve) for curve in wear.lives],
        fit=wear.fit,
        forecasts=wear.forecasts,
        limits=wear.limits,
        half=parameters.half,
        natural_limit=parameters.natural_limit,
        removed=wear.total / parameters.factor + wear.now.lifted,
        corrects=not parameters.measures_only,
        widening=wear.record.widening,
    )


def _life(curve: Curve) -> Life:
    return Life(curve.sequence.tolist(), curve.worn.tolist(), curve.removed.tolist(), curve.counts.tolist())
