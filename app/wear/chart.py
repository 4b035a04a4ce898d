"""From the wear curve as it is read to the one that is drawn."""

from app.wear.figures import Life, WearChart
from app.wear.queries import Curve, Wear


def chart_of(wear: Wear) -> WearChart:
    """What the figure needs."""
    parameters = wear.standing.parameters
    return WearChart(
        key=wear.standing.characteristic.key,
        now=_life(wear.now),
        lives=[_life(curve) for curve in wear.lives],
        fit=wear.fit,
        forecasts=wear.forecasts,
        limits=wear.limits,
        half=parameters.tolerance_width / 2,
        taken=wear.total / parameters.factor + wear.now.lifted,
        corrects=not parameters.measures_only,
    )


def _life(curve: Curve) -> Life:
    return Life(curve.sequence.tolist(), curve.worn.tolist(), curve.taken.tolist(), curve.counts.tolist())
