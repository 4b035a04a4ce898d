"""The newest readings of a characteristic, regressed on their temperatures. Never writes."""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.core.decision.limits import WEAR
from app.core.drift import WARM_UP, Drift, drift
from app.core.spc.quantity import Quantity
from app.core.spc.refusal import Floats, Refused
from app.core.temperature import HIGHEST, LOWEST, PER_KELVIN, Expansion
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.expansion.queries import expansion_of, temperatures_between
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.quality.baselines.series_queries import ReadingSeries, read
from app.quality.baselines.tables import Baseline

USUAL, MOST = 2_000, 20_000  # readings, the newest
Body = Literal["part", "machine"]


class Study(NamedTuple):
    """Readings and their drift; `refused` where they carry none.

    of: whose temperature it is; both: part and machine have some. readings, stated: that count, and those of them with a
    temperature. unknown: left out, for it is not known with which corrections their part was cut. rebuilt: with the corrections
    taken out; worn: left out, of worn or broken tools. Of readings whose corrections are not known sizes are as they came out. expected: by the expansion alone, mm/K.
    """

    current: CurrentCharacteristic
    expansion: Expansion
    of: Body
    both: bool
    readings: int
    stated: int
    unknown: int
    worn: int
    rebuilt: bool
    warm_up: int
    expected: float | None
    drift: Drift | Refused


def study_of(
    session: Session,
    current: CurrentCharacteristic,
    *,
    last: int = USUAL,
    of: Body | None = None,
    pause: float | None = None,
    warm_up: int = WARM_UP,
) -> Study:
    """Regress the newest readings. of: whose temperature; None: the part's, or the machine's where that is believed more often.

    pause: minutes without a reading that are one; None: by the distance of the readings. warm_up: parts that a machine needs.
    """
    window = statistics.window_of(session, current.characteristic, last=last)
    found, rebuilt = _readings(session, current, window)
    parts = statistics.history_of(session, current.characteristic, window, ["measured_at", "zone"])
    unworn = ~np.isin(found.series.sequence, parts["sequence"][parts["zone"] == WEAR])
    series, measured_at = found.series.only(unworn), found.measured_at[unworn]
    temperatures = _temperatures(session, current, window, series.sequence)
    stated = {body: int((~np.isnan(values)).sum()) for body, values in temperatures.items()}
    good = {body: int(((values >= LOWEST) & (values <= HIGHEST)).sum()) for body, values in temperatures.items()}
    chosen: Body = of or ("part" if good["part"] >= good["machine"] else "machine")
    expansion = expansion_of(session, current.machine.id, current.characteristic.id)
    begin, minute = parts["measured_at"][:1], np.timedelta64(1, "m")
    result: Drift | Refused
    try:
        result = drift(
            series.sequence,
            series.values,
            series.edge,
            (measured_at - begin) / minute,
            temperatures[chosen],
            cut=(parts["sequence"], (parts["measured_at"] - begin) / minute),
            pause=pause,
            warm_up=warm_up,
        )
    except Refused as refused:
        result = refused
    return Study(
        current,
        expansion,
        chosen,
        all(stated.values()),
        len(series),
        stated[chosen],
        len(found.left_out.unknown) if rebuilt else 0,
        int((~unworn).sum()),
        rebuilt,
        warm_up,
        _expected(expansion, chosen, current.parameters.target),
        result,
    )


def _readings(session: Session, current: CurrentCharacteristic, window: Window) -> tuple[ReadingSeries, bool]:
    """Sizes without corrections; as they came out where no correction is known, as of imports."""
    plan = Baseline(
        quantity=Quantity.WITHOUT_CORRECTIONS.value,
        excluded=[],
        first_sequence=1,
        last_sequence=0,
        factor=current.parameters.factor,
    )
    found = read(session, current, plan, window)
    if len(found.series) or not len(found.left_out.unknown):
        return found, True
    plan.quantity = Quantity.DEVIATION.value
    return read(session, current, plan, window), False


def _temperatures(
    session: Session, current: CurrentCharacteristic, window: Window, sequence: NDArray[np.int64]
) -> dict[Body, Floats]:
    """Temperatures of these readings of the window, °C; NaN where none is stated."""
    known = temperatures_between(session, current.characteristic, window.first, window.last)
    pairs = np.array([known.get(number, (None, None)) for number in sequence.tolist()], np.float64).reshape(-1, 2)
    return {"part": pairs[:, 0], "machine": pairs[:, 1]}


def _expected(expansion: Expansion, of: Body, target: float) -> float | None:
    """Change of the measured size by a kelvin, mm, if nothing but part or scale expands."""
    length = target if expansion.length is None else expansion.length
    if of == "part":
        return None if expansion.coefficient is None else length * expansion.coefficient * PER_KELVIN
    return None if expansion.scale_coefficient is None else -length * expansion.scale_coefficient * PER_KELVIN
