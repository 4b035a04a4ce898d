"""Titles and numbers of the examples, in words."""

from app.language.i18n import _, ngettext
from app.quality.proof.cases import Basis, Case, Value
from app.quality.proof.queries import Check


def topics() -> dict[str, tuple[str, tuple[str, ...]]]:
    """Topics that sort the examples on the page: a heading and the kinds below it."""
    return {
        "decision": (
            _("Decision and measuring"),
            ("decision", "mean_nominal", "fits", "running_average", "signal_path"),
        ),
        "forecast": (_("Parts left of a tool"), ("parts_left",)),
        "summary": (_("Mean, spread, autocorrelation"), ("summary",)),
        "charts": (
            _("Control charts"),
            (
                "constants",
                "d2_star",
                "freedom",
                "individuals",
                "subgroups",
                "ewma",
                "moving_average",
                "cusum",
                "count_chart",
                "rules_on_data",
            ),
        ),
        "chance": (
            _("How often charts signal"),
            ("rule_probability", "rule_run_length", "ewma_run_length", "cusum_run_length"),
        ),
        "capability": (
            _("Capability and normality"),
            (
                "capability",
                "potential",
                "intervals",
                "machine_performance",
                "one_sided_bounds",
                "percentile",
                "percentile_indices",
                "order_statistics",
                "distribution",
                "goodness_of_fit",
                "tolerance_factors",
                "tolerance_extremes",
                "anderson_darling",
                "anderson_p",
                "shapiro_wilk",
            ),
        ),
        "in_time": (_("Behaviour in time"), ("variance_in_time", "scatter_in_time", "following")),
        "gauge": (_("Gauge studies"), ("gauge_ranges", "gauge_anova", "linearity", "bias", "type_one")),
        "geometry": (_("Geometry"), ("circle_fit", "line_fit", "plane_fit", "printed_straightness")),
    }


def number(value: float | bool | None) -> str:
    """A number with the digits that can be distinguished at the tolerances in use."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    return f"{value:.12g}"


def written(value: Value | None) -> str:
    """A number, or a list of them."""
    return ", ".join(map(number, value)) if isinstance(value, list) else number(value)


def basis(case: Case) -> str:
    """Source of expected numbers that nobody published; empty for published ones."""
    return {
        Basis.PUBLISHED: "",
        Basis.DERIVED: _("derived by hand"),
        Basis.COMPUTED: _("computed independently"),
        Basis.SIMULATED: _("simulated"),
    }[case.basis]


def expected(case: Case) -> str:
    """Over the column of what is expected."""
    return _("Published") if case.basis is Basis.PUBLISHED else _("Expected")


def size(check: Check) -> int:
    return len(check.expected) if isinstance(check.expected, list) else 1


def numbers(count: int) -> str:
    return ngettext("%(num)d number", "%(num)d numbers", count) % {"num": count}


def warning(failing: int) -> str:
    """For the top of pages with statistics."""
    return ngettext(
        "%(num)d published example does not come out as published. Do not rely on the statistics of this program until that is settled.",
        "%(num)d published examples do not come out as published. Do not rely on the statistics of this program until that is settled.",
        failing,
    ) % {"num": failing}
