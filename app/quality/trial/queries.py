"""The readings of a characteristic that only measures, and the same parts in a loop that corrects them. Never writes."""

from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.parameters import Mode, Parameters
from app.core.policy_map import Criterion, best_region, in_order, with_settings
from app.core.replay import Figures, figures_of, run
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.quality.what_if import queries
from app.quality.what_if.queries import ToolHistory, map_axes, on_all_cores, turn

USUAL = 1_000  # readings, the newest
ENOUGH = 100  # readings, from which on settings are proposed
DELAY = 1  # parts that are cut before a correction is in effect


class Settings(NamedTuple):
    """Settings of a loop; mm."""

    weighting_factor: float
    zero_range: float


@dataclass(frozen=True)
class Trial:
    """Side by side: as it was measured, corrected by today's settings, and by those proposed (None: too few readings)."""

    past: ToolHistory
    delay: int
    without: Figures
    today: Figures
    proposed: Figures | None
    settings: Settings | None

    @property
    def parameters(self) -> Parameters:
        """In force."""
        return self.past.current.parameters


def trial_of(session: Session, current: CurrentCharacteristic, last: int = USUAL, delay: int = DELAY) -> Trial:
    """Replay the newest readings. Raises `Invalid` where there are fewer than two, `TooManyRequests` while other replays run."""
    with turn():
        window = statistics.window_of(session, current.characteristic, last=last, usable=True)
        past = queries.load(session, current, window)
        loop = replace(current.parameters, mode=Mode.AUTOMATIC)
        today = past.carried(run(past.trace, past.policy(loop, delay))[1])
        truly = queries.truly_of(session, past)
        settings, proposed = _proposed(past, loop, today, delay) if truly.readings >= ENOUGH else (None, None)
    return Trial(past, delay, truly, today, proposed, settings)


def _proposed(
    past: ToolHistory, loop: Parameters, today: Figures, delay: int
) -> tuple[Settings | None, Figures | None]:
    """Of the settings whose Ppk cannot be distinguished from the best the one that corrects least, as the map of *What if* marks it."""
    ks = map_axes.weighting_factors(loop)
    grid = [
        settings
        for settings in map(Settings._make, product(ks, map_axes.zero_ranges(loop, loop.averaging_limit)))
        if in_order(with_settings(loop, **settings._asdict()))
    ]
    policies = [past.policy(with_settings(loop, **settings._asdict()), delay) for settings in grid]
    found = [past.carried(each) for each in on_all_cores(lambda share: figures_of(past.trace, share), policies)]
    criterion = Criterion.PPK if today.ppk is not None else Criterion.REJECTS
    best = best_region(found, criterion, today).calmest
    return (None, None) if best is None else (grid[best], found[best])
