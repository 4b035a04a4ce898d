"""Multiple linear regression by least squares: partial effects with intervals, and what cannot be separated.

    y = level of its group + b1 x1 + b2 x2 + … + scatter

Each b is a *partial* effect: what one unit of x changes while the others stay. Levels are taken out by centring y and every x
in each group (Frisch and Waugh 1933, Econometrica 1, 387), so that steps between groups count for nothing.

*Collinearity.* The variance inflation of a column is 1 / (1 - R²) with R² from regressing it on the others (Marquardt 1970,
Technometrics 12, 591): by so much its standard error, squared, is larger than if it were alone. Beyond `INFLATED` its effect
is hard to tell from the others'. A column that does not vary, or that others determine, has no effect of its own, nor have
those that determine it: the plane is fitted all the same, but it cannot be determined which of them it is. They are named in `left_out`.

*Scatter of neighbours that is alike.* Readings of a process drift together, so an interval from the standard error of
independent ones is too narrow. As in `app.core.wear`, n readings count as n (1 - rho) / (1 + rho) (Santer et al. 2000). The
standard deviation about the plane is at least that of rounding, step / sqrt(12).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.resolution import resolution_of
from app.core.spc.spread import t_quantile
from app.core.spc.variation import varies
from app.core.wear import autocorrelation

LEVEL = 0.95  # of confidence, two-sided
INFLATED = 10.0
"""Variance inflation from which an effect is hard to tell from the others (Marquardt 1970)."""
DETERMINED = 1e-10  # of the squares of a column: as little is left where those before it determine it
FEWEST = 8  # degrees of freedom


class LeftOut(StrEnum):
    """Reason why a column has no effect of its own."""

    CONSTANT = "constant"
    DETERMINED = "determined"


@dataclass(frozen=True, slots=True)
class Effect:
    """A partial effect: y per unit of x, its standard error and interval (`LEVEL`), and the probability of as much by chance.

    inflation: of its variance by the other columns. share: of the squares about the levels that it explains beyond the others.
    """

    value: float
    standard_error: float
    low: float
    high: float
    p_value: float
    inflation: float
    share: float

    @property
    def significant(self) -> bool:
        """Tell if its interval does not hold 0."""
        return self.low > 0 or self.high < 0

    @property
    def inflated(self) -> bool:
        """Tell if it is hard to tell from the others."""
        return self.inflation > INFLATED


@dataclass(frozen=True, slots=True)
class Regression:
    """The plane through `readings` readings in `levels` groups. scatter: standard deviation about it; r_squared: explained share.

    correlation: lag-1 autocorrelation of the residuals (0 where it is not counted). effective: how many independent readings it
    is worth. residuals: by reading.
    """

    readings: int
    levels: int
    effects: Mapping[str, Effect]
    left_out: Mapping[str, LeftOut]
    r_squared: float
    scatter: float
    correlation: float
    effective: float
    residuals: Floats


def regression(
    y: Floats,
    columns: Mapping[str, Floats],
    groups: NDArray[np.int64] | None = None,
    *,
    independent: bool = False,
) -> Regression:
    """Regress y on the columns, in order of time. groups: of which level each reading is; independent: neighbours are not alike.

    Raises `Refused` for fewer readings than leave `FEWEST` degrees of freedom, and where y does not vary.

    >>> x = np.arange(40.0)
    >>> z = np.sin(x)
    >>> found = regression(3 * x + z, {"x": x, "twice": 2 * x, "z": z})
    >>> round(found.effects["z"].value, 2), found.left_out["x"].value, found.left_out["twice"].value
    (1.0, 'determined', 'determined')
    """
    count = len(y)
    names, places = np.unique(np.zeros(count) if groups is None else groups, return_inverse=True)
    freedom = count - len(names) - len(columns)
    if freedom < FEWEST:
        raise Refused(Reason.TOO_FEW_READINGS, have=count, needed=len(names) + len(columns) + FEWEST)
    centred = _centred(y, places)
    total = float(centred @ centred)
    if not varies(sqrt(total / count), y):
        raise Refused(Reason.NO_VARIATION)
    chosen, left_out, unclear = _independent_of_each_other(
        {name: (x, _centred(x, places)) for name, x in columns.items()}
    )
    matrix = np.column_stack([x / np.linalg.norm(x) for x in chosen.values()]) if chosen else np.empty((count, 0))
    q, r = np.linalg.qr(matrix)
    scaled = np.linalg.solve(r, q.T @ centred)
    inverse = np.linalg.inv(r)
    inflation = (inverse**2).sum(axis=1)
    residuals = centred - matrix @ scaled
    squares = float(residuals @ residuals)
    rho = 0.0 if independent or not varies(sqrt(squares / count), y) else autocorrelation(residuals)
    loss = (1 + rho) / (1 - rho)
    freedom = count - len(names) - len(chosen)
    scatter = max(sqrt(squares / freedom), resolution_of(y).step / sqrt(12))
    effects = {}
    for at, (name, x) in enumerate(chosen.items()):
        if name in unclear:
            continue
        norm = float(np.linalg.norm(x))
        error = scatter * sqrt(float(inflation[at]) * loss) / norm
        share = float(scaled[at] ** 2 / inflation[at]) / total
        effects[name] = _effect(float(scaled[at]) / norm, error, freedom / loss, float(inflation[at]), share)
    return Regression(
        readings=count,
        levels=len(names),
        effects=effects,
        left_out=left_out | dict.fromkeys(unclear, LeftOut.DETERMINED),
        r_squared=min(1.0, max(0.0, 1 - squares / total)),
        scatter=scatter,
        correlation=rho,
        effective=count / loss,
        residuals=residuals,
    )


def _centred(x: Floats, places: NDArray[np.intp]) -> Floats:
    """Distances from the mean of each group."""
    off: Floats = x - x.mean()  # the sums of large numbers would cost digits
    return np.asarray(off - (np.bincount(places, off) / np.bincount(places))[places])


def _independent_of_each_other(
    columns: Mapping[str, tuple[Floats, Floats]],
) -> tuple[dict[str, Floats], dict[str, LeftOut], set[str]]:
    """Columns (as they are, and centred) that make the plane, the others with the reason, and those of the plane that determine one."""
    chosen: dict[str, Floats] = {}
    left_out: dict[str, LeftOut] = {}
    unclear: set[str] = set()
    for name, (raw, x) in columns.items():
        squares = float(x @ x)
        if not varies(sqrt(squares / len(x)), raw):
            left_out[name] = LeftOut.CONSTANT
            continue
        before = np.column_stack(list(chosen.values())) if chosen else np.empty((len(x), 0))
        norms = np.linalg.norm(before, axis=0)
        q, r = np.linalg.qr(before / norms)
        rest = x - q @ (q.T @ x)
        if float(rest @ rest) < DETERMINED * squares:
            left_out[name] = LeftOut.DETERMINED
            parts = np.abs(np.linalg.solve(r, q.T @ x))  # by which each of those before makes it up
            unclear |= {each for each, part in zip(chosen, parts, strict=True) if part > sqrt(DETERMINED * squares)}
        else:
            chosen[name] = x
    return chosen, left_out, unclear


def _effect(value: float, error: float, freedom: float, inflation: float, share: float) -> Effect:
    freedom = max(1.0, freedom)
    half = t_quantile(freedom, LEVEL) * error
    chance = 2 * float(stdtr(freedom, -abs(value) / error)) if error > 0 else 0.0
    return Effect(value, error, value - half, value + half, chance, inflation, share)
