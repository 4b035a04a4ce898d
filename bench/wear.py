"""How many forecasts of wear hold on public wear series, at four moments of a life: the lower half of the table in docs/reference/wear.md.

The series are other people's and are no part of Inband. Fetch the files that are named below from their repositories, and name
those that are there; each tool is then left out of the tuning in turn, and each data set::

    python -m bench.wear --phm phm2010_wear_percut.csv --uniwear uniwear.csv --campaign manifest_multitool.csv --nasa mill.csv

- ``--phm``, ``--campaign``: github.com/sudomanuel/minimum-data-tool-wear-prognosis at 24b45b5, data/external/phm2010 and
  data/input/derived. PHM Society data challenge 2010, largest wear of three flutes by cut; and the tools with 12 measurements and more.
- ``--uniwear``: github.com/katulu-io/uniwear-dataset at 66c894f, data. The nine NUAA cutters.
- ``--nasa``: mill.csv, NASA Ames and UC Berkeley (Agogino and Goebel 2007), cases with six measurements and more.

Each series is interpolated to 120 and 400 parts from its first to its last measurement, with scatter of 1 and 3 % of its wear,
to its end and to 70 % of its wear; each tool weighs alike. What is printed is the same each time.
"""

import argparse
import csv
import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from app.core.forecast import LOOKS, MOST_WIDENING, PUBLIC_WIDENING, needed_at
from app.core.wear import LEVEL, Values

FEWEST = 6
"""Measurements of a tool."""
Tool = tuple[str, str]
Needed = dict[Tool, list[list[float]]]
"""Of each tool and each moment: the exponents with which its forecasts would just have held."""


def rows(path: Path | None) -> Iterator[dict[str, str]]:
    """The rows of a file; none where no file is named."""
    if path is not None:
        with path.open(encoding="utf-8", newline="") as text:
            yield from csv.DictReader(text)


def series(of: argparse.Namespace) -> dict[Tool, tuple[Values, Values]]:
    """Place and wear of each tool that the named files have."""
    found: dict[Tool, list[tuple[float, float]]] = defaultdict(list)
    for row in rows(of.phm):
        found["PHM", row["cutter"]].append((float(row["cut"]), float(row["max_wear"])))
    for row in rows(of.uniwear):
        if row["dataset_tag"] == "nuaa":
            found["NUAA", row["experiment_tag"]].append((float(row["timestamp"]), float(row["tool_wear"])))
    for row in rows(of.campaign):
        found["campaign", row["tool_id"]].append((float(row["within_tool_order"]), float(row["vb_um"])))
    for row in rows(of.nasa):
        if row["VB"]:
            found["NASA", row["case"]].append((float(row["time"]), float(row["VB"])))
    fewest = {"campaign": 12}
    return {
        tool: (np.array(points)[:, 0], np.array(points)[:, 1])
        for tool, points in found.items()
        if len(points) >= fewest.get(tool[0], FEWEST)
    }


def lives(places: Values, wear: Values, rng: np.random.Generator) -> Iterator[Values]:
    """Lives made of one series: of two lengths, with two scatters, to its end and to 70 % of its wear."""
    order = np.argsort(places, kind="stable")
    places, wear = places[order], (wear[order] - wear[order][0]) / (wear.max() - wear[order][0])
    for parts, scatter, level in itertools.product((120, 400), (0.01, 0.03), (1.0, 0.7)):
        end = places[int(np.argmax(wear >= level))]
        curve = np.interp(np.linspace(places[0], end, parts), places, wear)
        for _ in range(5):
            yield curve + rng.normal(0, scatter * level, parts)


def needed(tools: dict[Tool, tuple[Values, Values]]) -> Needed:
    """What the forecasts of each tool needed, at each moment."""
    rng = np.random.default_rng(2010)
    found: Needed = {}
    for tool, (places, wear) in tools.items():
        moments: list[list[float]] = [[] for _ in LOOKS]
        for curve in lives(places, wear, rng):
            for place, exponent in needed_at(np.arange(1, len(curve) + 1), curve):
                moments[LOOKS.index(place)].append(exponent)
        found[tool] = moments
    return found


def held(of: Needed, tools: Sequence[Tool], widening: float) -> list[float]:
    """The share of forecasts that hold at each moment; each tool weighs alike. Not a number where none was made."""
    shares = np.array(
        [[np.mean(np.array(each) <= widening) if each else np.nan for each in of[tool]] for tool in tools]
    )
    return [
        float(np.nanmean(shares[:, moment])) if (shares[:, moment] >= 0).any() else np.nan
        for moment in range(len(LOOKS))
    ]


def widening_of(of: Needed, tools: Sequence[Tool]) -> float:
    """The exponent that these tools teach: the (1 + 1/n) 95 % quantile at the worst moment, n tools weighing alike (split conformal)."""
    worst = 0.0
    level = min(1.0, LEVEL * (1 + 1 / len(tools)))
    for moment in range(len(LOOKS)):
        exponents = np.concatenate([of[tool][moment] for tool in tools])
        weights = np.concatenate([[1 / max(len(of[tool][moment]), 1)] * len(of[tool][moment]) for tool in tools])
        order = np.argsort(exponents)
        reached = np.cumsum(weights[order]) / weights.sum() >= level - 1e-12
        worst = max(worst, float(exponents[order][int(np.argmax(reached))]))
    return min(worst, MOST_WIDENING)


def left_out(of: Needed, tools: Sequence[Tool], *, sets: bool) -> tuple[list[float], list[float]]:
    """What holds where each tool (or its whole set) is left out of the tuning, and the exponents that the others taught."""
    taught = {
        tool: widening_of(of, [other for other in of if (other[0] != tool[0] if sets else other != tool)])
        for tool in tools
    }
    shares = [held(of, [tool], taught[tool]) for tool in tools]
    return [float(np.nanmean([each[moment] for each in shares])) for moment in range(len(LOOKS))], list(taught.values())


def line(name: str, shares: Sequence[float], note: str = "") -> None:
    """Print one row of the table."""
    print(f"{name:48}", *(f"{100 * share:6.0f} %" for share in shares), f"  {note}")


def main() -> None:
    """Print what holds, over all tools and in each set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("phm", "uniwear", "campaign", "nasa"):
        parser.add_argument(f"--{name}", type=Path)
    of = needed(series(parser.parse_args()))
    if not of:
        parser.error("name a file with wear series; the head of bench/wear.py says where they are")
    print(f"{'':48}", *(f"{100 * share:6.0f} %" for share in LOOKS), "  of a life")
    groups = {"all": list(of)} | {
        name: [tool for tool in of if tool[0] == name] for name in dict.fromkeys(tool[0] for tool in of)
    }
    for name, tools in groups.items():
        line(f"{name}, {len(tools)} tools, widening {PUBLIC_WIDENING}", held(of, tools, PUBLIC_WIDENING))
        shares, taught = left_out(of, tools, sets=False)
        line("  each tool left out of the tuning", shares, f"{min(taught):.2f} to {max(taught):.2f}")
        if len(groups) > len(("all", "one set")):
            shares, taught = left_out(of, tools, sets=True)
            line("  each data set left out of the tuning", shares, f"{min(taught):.2f} to {max(taught):.2f}")


if __name__ == "__main__":
    main()
