"""The map as the page draws it: rows of k, columns of R33, each cell a link that takes its setting. Pure."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from app.core.policy_map import Criterion, value_of
from app.language.formatting import short
from app.language.i18n import _
from app.quality.what_if import form_reader, map_axes, wording
from app.quality.what_if.queries import Cell, Map, Simulation

LEVELS = 8  # shades from the best to the worst


class CellView(NamedTuple):
    """One cell: where it leads, what it says, its shade (None: blank), what it is, and where the best region ends at it.

    edges: of the letters t, r, b, l those sides beyond which settings are worse.
    """

    href: str | None
    text: str
    title: str
    level: int | None
    inside: bool
    best: bool
    calmest: bool
    today: bool
    chosen: bool
    edges: str


class MapView(NamedTuple):
    """R33 of the columns in µm, then a row a k. region: in words."""

    columns: list[str]
    rows: list[tuple[str, list[CellView]]]
    region: str
    explained: str


def view_of(settings_map: Map, answer: Simulation, typed: Mapping[str, str], key: str) -> MapView:
    """Everything in words, shades by rank, so that one bad corner does not wash out the rest."""
    values = [
        value_of(cell.figures, settings_map.criterion) if cell.figures is not None and choice else None
        for cell, choice in zip(settings_map.cells, settings_map.region.choice, strict=True)
    ]
    known = sorted({value for value in values if value is not None}, reverse=settings_map.criterion is Criterion.PPK)
    rank = {value: at * LEVELS // max(1, len(known)) for at, value in enumerate(known)}
    wide = len(settings_map.zero_ranges)
    today, chosen = settings_map.past.current.parameters, answer.parameters
    at_today = _at(settings_map, today.weighting_factor, today.zero_range)
    if abs(settings_map.averaging_limit - today.averaging_limit) > 1e-9:
        at_today = None
    at_chosen = _at(settings_map, chosen.weighting_factor, chosen.zero_range)
    cells = [
        _cell(
            settings_map,
            at,
            cell,
            None if values[at] is None else rank[values[at]],  # type: ignore[index]
            form_reader.address(key, typed, k=f"{cell.weighting_factor:.9g}", r33=f"{cell.zero_range * 1000:.9g}")
            + "#replay",
            today=at == at_today,
            chosen=at == at_chosen,
        )
        for at, cell in enumerate(settings_map.cells)
    ]
    cells = [cell._replace(edges=_edges(settings_map.region.inside, at, wide)) for at, cell in enumerate(cells)]
    return MapView(
        [short(r33 * 1000) for r33 in settings_map.zero_ranges],
        [
            (f"{k:.6g}", cells[row * wide : (row + 1) * wide])
            for row, k in reversed(list(enumerate(settings_map.weighting_factors)))
        ],
        _region(settings_map),
        wording.criterion_explained(settings_map.criterion),
    )


def _at(settings_map: Map, k: float, r33: float) -> int | None:
    row, column = map_axes.place(settings_map.weighting_factors, k), map_axes.place(settings_map.zero_ranges, r33)
    return None if row is None or column is None else row * len(settings_map.zero_ranges) + column


def _edges(inside: Sequence[bool], at: int, wide: int) -> str:
    """Sides of a cell at which the region ends; a row above is a larger k, as the page draws it."""
    if not inside[at]:
        return ""
    column = at % wide
    neighbours = {
        "t": at + wide if at + wide < len(inside) else None,
        "r": at + 1 if column + 1 < wide else None,
        "b": at - wide if at >= wide else None,
        "l": at - 1 if column else None,
    }
    return "".join(side for side, there in neighbours.items() if there is None or not inside[there])


def _cell(
    settings_map: Map, at: int, cell: Cell, level: int | None, href: str, *, today: bool, chosen: bool
) -> CellView:
    named = _("k {k}, R33 {r33}").format(
        k=f"{cell.weighting_factor:.6g}", r33=wording.setting("zero_range", cell.zero_range)
    )
    if cell.figures is None:
        return CellView(
            href=None, text="", title=f"{named}: {wording.out_of_order(cell.zero_range, settings_map.averaging_limit)}", level=None,
            inside=False, best=False, calmest=False, today=today, chosen=chosen, edges="",
        )  # fmt: skip
    inside, best, calmest = (
        settings_map.region.inside[at],
        settings_map.region.best == at,
        settings_map.region.calmest == at,
    )
    lines = [
        f"{name} {value[0]}"
        for name, value in wording.rows([cell.figures])
        if name in {_("Ppk (as if normal)"), _("Rejects"), _("Corrections"), _("Spread s")}
    ]
    marks = [
        word
        for word, holds in (
            (_("current"), today),
            (_("best"), best),
            (_("as good as the best"), inside and not best),
            (_("fewest corrections among the equally good"), calmest),
        )
        if holds
    ]
    sequence = settings_map.past.history["sequence"]
    window = _("of {n} readings, {first} to {last}").format(n=cell.figures.inner, first=sequence[0], last=sequence[-1])
    title = f"{named}: {', '.join(lines)}, {window}" + (f" ({', '.join(marks)})" if marks else "")
    text = wording.cell(cell.figures, settings_map.criterion)
    return CellView(
        href=href,
        text=text,
        title=title,
        level=level,
        inside=inside,
        best=best,
        calmest=calmest,
        today=today,
        chosen=chosen,
        edges="",
    )


def _region(settings_map: Map) -> str:
    if settings_map.region.best is None or settings_map.region.calmest is None:
        return _("No setting of this map meets this goal.")
    best, calmest = settings_map.cells[settings_map.region.best], settings_map.cells[settings_map.region.calmest]
    assert best.figures is not None
    assert calmest.figures is not None
    inside = [cell for cell, holds in zip(settings_map.cells, settings_map.region.inside, strict=True) if holds]
    ks, r33s = [cell.weighting_factor for cell in inside], [cell.zero_range for cell in inside]
    lines = [
        _("Best is k {k} with R33 {r33}: {criterion} {value}, now {today}.").format(
            k=f"{best.weighting_factor:.6g}",
            r33=wording.setting("zero_range", best.zero_range),
            criterion=wording.criterion(settings_map.criterion),
            value=wording.cell(best.figures, settings_map.criterion),
            today=wording.cell(settings_map.today, settings_map.criterion),
        )
    ]
    if len(inside) > 1:
        lines.append(
            _(
                "{count} settings are as good (within 5 %, or what {readings} readings can tell): k {low_k} to {high_k}, R33 {low} to {high} µm."
            ).format(
                count=len(inside),
                readings=settings_map.today.inner,
                low_k=f"{min(ks):.6g}",
                high_k=f"{max(ks):.6g}",
                low=short(min(r33s) * 1000),
                high=short(max(r33s) * 1000),
            )
        )
    if settings_map.region.calmest != settings_map.region.best:
        lines.append(
            _(
                "Fewest corrections among the equally good: k {k} with R33 {r33}, {count} corrections; now {today}."
            ).format(
                k=f"{calmest.weighting_factor:.6g}",
                r33=wording.setting("zero_range", calmest.zero_range),
                count=calmest.figures.corrections,
                today=settings_map.today.corrections,
            )
        )
    return " ".join(lines)
