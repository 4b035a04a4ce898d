"""Results of a what-if as plain values: the same numbers for the API, for a proposal's evidence and for the page."""

from typing import Any

from app.core.measured_gain import Effect
from app.core.replay import Figures
from app.core.spc.quoting import Quoting
from app.core.spc.refusal import Refused
from app.loop.summaries.wording import refusal
from app.quality.what_if import wording
from app.quality.what_if.queries import Cell, Likeness, Map, Sampling, Simulation
from app.quality.what_if.tool_history import ToolHistory

SETTINGS = ("weighting_factor", "zero_range", "averaging_limit", "factor")


def evidence_of(answer: Simulation) -> dict[str, Any]:
    """Side by side, with the period, the assumption, and how far the replay can be believed. Lengths in mm."""
    today = answer.past.current.parameters
    truly, replayed, other = map(quote_of, answer.quotes)
    return period_of(answer.past) | {
        "parameters_version": answer.past.current.version.version,
        "delay": answer.delay,
        "effect": answer.settings.effect,
        "truly": figures_of(answer.truly) | truly,
        "likeness": likeness_of(answer.likeness),
        "today": {"settings": {name: getattr(today, name) for name in SETTINGS}} | figures_of(answer.today) | replayed,
        "other": {"settings": {name: getattr(answer.parameters, name) for name in SETTINGS}}
        | figures_of(answer.other)
        | other,
        "measured_effect": effect_of(answer.effect),
        "cautions": wording.cautions(answer.past),
    }


def period_of(past: ToolHistory) -> dict[str, Any]:
    """Readings of the what-if, as a period."""
    history = past.history
    return {
        "characteristic": past.current.characteristic.key,
        "first_sequence": int(history["sequence"][0]),
        "last_sequence": int(history["sequence"][-1]),
        "start": f"{history['measured_at'][0]}Z",
        "end": f"{history['measured_at'][-1]}Z",
        "readings": len(history),
        "left_out": past.unknown,
    }


def figures_of(figures: Figures) -> dict[str, Any]:
    """The numbers of one replay."""
    return figures._asdict() | {"alarms": figures.alarms}


def quote_of(quoting: Quoting) -> dict[str, Any]:
    """The index that may be quoted of them."""
    return {"quote": quoting.quote.value, "quoted": quoting.value, "why_none": quoting.why}


def sampling_of(sampling: Sampling) -> dict[str, Any]:
    """The same readings with fewer parts measured."""
    return period_of(sampling.past) | {
        "delay": sampling.delay,
        "settings": {name: getattr(sampling.parameters, name) for name in SETTINGS},
        "after_change": sampling.plan.after_change,
        "after_alarm": sampling.plan.after_alarm,
        "rows": [row._asdict() | {"figures": figures_of(row.figures)} for row in sampling.rows],
        "cautions": wording.cautions(sampling.past) + wording.sampled(sampling),
    }


def likeness_of(likeness: Likeness) -> dict[str, Any]:
    """Accuracy of the simulated loop against the real one."""
    return {
        "verdict": likeness.verdict,
        "off": likeness.off,
        "same": likeness.same,
        "text": wording.likeness(likeness),
        "replayed": figures_of(likeness.figures),
    }


def effect_of(effect: Effect | Refused) -> dict[str, Any]:
    """Measured effect of corrections."""
    if isinstance(effect, Refused):
        nothing = dict.fromkeys(("value", "low", "high", "corrections", "readings", "typical", "scatter"))
        return nothing | {"is_full": None, "text": _unsaid(effect)}
    return effect._asdict() | {"is_full": effect.is_full, "text": wording.effect(effect)}


def _unsaid(refused: Refused) -> str:
    return wording.effect_unknown(refused, refusal(refused))


def cell_of(settings_map: Map, at: int, cell: Cell) -> dict[str, Any]:
    """One cell of a map; what cannot be set says why."""
    figures = cell.figures
    return {
        "weighting_factor": cell.weighting_factor,
        "zero_range": cell.zero_range,
        "figures": None if figures is None else figures_of(figures),
        "inside": settings_map.region.inside[at],
        "best": settings_map.region.best == at,
        "calmest": settings_map.region.calmest == at,
        "reason": None if figures is not None else wording.out_of_order(cell.zero_range, settings_map.averaging_limit),
    }
