"""Capability as JSON. Lengths in mm."""

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, Field

from app.core.natural_limit import NaturalLimit
from app.core.spc.capability import Fallout, Index, PercentileCapability
from app.core.spc.distributions import Family
from app.core.spc.fitting import Fit, Fitted
from app.core.spc.in_time import InTime
from app.core.spc.normality import Normality
from app.core.spc.refusal import Refused
from app.loop.summaries import wording as statistics
from app.quality.capability import fit_wording, machine_wording, wording
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.machine_queries import Run
from app.quality.capability.queries import Study
from app.web.fields import answer_from


class IndexOut(BaseModel):
    """An index with its two-sided confidence interval."""

    value: float = Field(description="The index.")
    low: float | None = Field(description="Low end of the interval.")
    high: float | None = Field(description="High end of the interval.")
    method: str | None = Field(
        description="Of the interval: `chi_square`, `bissell`, `noncentral_t`, `boyles`, `delta`, `order_statistics`."
    )

    @classmethod
    def of(cls, found: Index | None) -> "IndexOut | None":
        """None where the limits do not define it."""
        return cls(value=found.value, low=found.low, high=found.high, method=found.interval) if found else None


class FalloutOut(BaseModel):
    """Parts per million beyond the limits."""

    below: float | None = Field(description="null beyond a natural limit.")
    above: float | None = Field(description="null beyond a natural limit.")
    total: float = Field(description="Beyond either limit.")

    @classmethod
    def of(cls, found: Fallout | None, natural: NaturalLimit) -> "FalloutOut | None":
        """None where there is nothing to count."""
        if found is None:
            return None
        return cls(
            below=None if natural is NaturalLimit.LOWER else found.below,
            above=None if natural is NaturalLimit.UPPER else found.above,
            total=found.total,
        )


class NormalityOut(BaseModel):
    """A test of normality; statistic and p_value are null where it could not be made."""

    test: Literal["anderson_darling", "shapiro_wilk"] = Field(description="Name of the test.")
    statistic: float | None = Field(description="A² or W; null where it could not be made.")
    p_value: float | None
    readings: int = Field(description="Looked at; of more than 5000, 5000 evenly taken.")
    text: str

    @classmethod
    def of(cls, test: Literal["anderson_darling", "shapiro_wilk"], found: Normality | Refused) -> "NormalityOut":
        """With its verdict in words."""
        text = wording.normality(found)
        if isinstance(found, Refused):
            return cls(test=test, statistic=None, p_value=None, readings=found.have, text=text)
        return cls(test=test, statistic=found.statistic, p_value=found.p_value, readings=found.readings, text=text)


class QuotedOut(BaseModel):
    """The index that may be quoted, with what it must not be read without."""

    index: Literal["cpk", "ppk", "fitted", "percentile"] = Field(description="Which index it is.")
    value: float = Field(description="The index.")
    low: float | None = Field(
        description="Of the interval; null by percentiles of fewer than 2731 readings: none bounds them."
    )
    high: float | None = Field(description="High end of the interval.")
    preliminary: bool = Field(description="Fewer than 100 readings, or than 1000 by percentiles.")
    method: str = Field(description="How it was computed, in words.")
    window: str = Field(description="How many readings, which, and the method, in words.")


class PercentileOut(BaseModel):
    """Pp and Ppk by percentiles (ISO 22514-2), for readings that are not normally distributed."""

    low: float = Field(description="X0.135 %")
    median: float = Field(description="X50 %, mm from the target.")
    high: float = Field(description="X99.865 %")
    pp: float | None = Field(description="The tolerance by X99.865 % - X0.135 %; null with one limit.")
    ppk: float = Field(description="To the nearer limit, by the percentiles.")
    interval: IndexOut = Field(
        description="Of Ppk, by order statistics; its low end is null below 2731 readings, at 95 %: none bounds the percentile."
    )


class FitOut(BaseModel):
    """A distribution that was fitted, and the test of how well it fits."""

    distribution: Family
    parameters: dict[str, float] = Field(description="By name; lengths in mm from the target.")
    statistic: float = Field(description="A² of Anderson and Darling.")
    p_value: float = Field(description="Of an A² as large by chance, the parameters estimated; 0.01 and more fits.")
    criterion: float = Field(description="Bayesian information criterion: the smallest that fits is taken.")


class FittedOut(FitOut):
    """Pp and Ppk by the distribution that fits (ISO 22514-2)."""

    low: float = Field(description="X0.135 %")
    median: float = Field(description="X50 %")
    high: float = Field(description="X99.865 %")
    pp: float | None = Field(description="The tolerance by X99.865 % - X0.135 %; null with one limit.")
    ppk: IndexOut
    ppm: FalloutOut = Field(description="Expected of this distribution.")
    why: str = Field(description="Why this one.")
    tried: list[FitOut] = Field(description="Every distribution that was tried, the best criterion first.")


class ToleranceIntervalOut(BaseModel):
    """An interval in which at least a share of all parts lies, with a confidence (ISO 16269-6), mm from the target."""

    share: float = Field(description="Of all parts, that lies in it at least: 0.9973.")
    confidence: float = Field(description="Probability that such an interval holds that share.")
    method: Literal["normal", "extremes"] = Field(
        description="By the normal distribution (exact factor), or from the smallest reading to the largest."
    )
    low: float | None = Field(description="null where only the upper limit counts.")
    high: float | None = Field(description="null where only the lower limit counts.")
    k: float | None = Field(description="Factor of the standard deviation; null by extremes.")
    reached: float = Field(description="The confidence that was reached; by extremes it is not below `confidence`.")


class MachinePerformanceOut(BaseModel):
    """Pm and Pmk (ISO 22514-3) of the newest run of parts in which nothing was changed."""

    readings: int = Field(description="Of the run.")
    first_sequence: int | None
    last_sequence: int | None
    first_at: datetime | None = Field(description="Time of its first reading; null without readings.")
    last_at: datetime | None = Field(description="Time of its last reading.")
    left_out: int = Field(description="Readings in between that were excluded, or probe faults.")
    mean: float | None = Field(description="In mm from the target.")
    sigma: float | None = Field(description="Standard deviation of all its readings, mm.")
    pm: IndexOut | None = Field(description="The tolerance by the spread; null with one limit.")
    pmk: IndexOut | None = Field(description="To the nearer limit.")
    distribution: Family | None = Field(description="The distribution that they are by; null: normal.")
    refused: str | None = Field(description="Why there is no Pmk.")


class TestOut(BaseModel):
    """A test that the model was chosen by."""

    question: str = Field(description="What is asked.")
    test: str = Field(description="Name of the test.")
    numbers: str = Field(description="Its numbers, in words.")
    answer: str = Field(description="What it says.")


class InTimeOut(BaseModel):
    """The time-dependent distribution model of ISO 22514-2."""

    model: Literal["A1", "A2", "B", "C1", "C2", "C3", "C4", "D"] = Field(
        description="The model of ISO 22514-2 that fits."
    )
    location: Literal["constant", "random", "systematic", "both"] = Field(description="How the mean changes.")
    scatter_changes: bool = Field(description="The scatter inside subgroups changes.")
    share_between: float = Field(description="Share of the variance that lies between the subgroups.")
    slope: float = Field(description="Of the line through the subgroup means, mm per reading.")
    subgroups: int = Field(description="Number of subgroups.")
    tests: list[TestOut] = Field(description="The tests that the model was chosen by.")
    text: str
    means: str = Field(description="Which index it allows.")


class FiredOut(BaseModel):
    """Number of signals of a run rule, and the number that chance explains."""

    rule: str = Field(description="Name of the run rule.")
    signals: int = Field(description="Number of its signals.")
    expected: float = Field(description="Number that chance explains.")
    p_value: float


class WithoutOut(BaseModel):
    """The same readings with what was corrected taken out again (wear curve)."""

    readings: int
    lives: int = Field(description="Stretches between tool changes and other steps of the reference.")
    mean: float
    standard_deviation: float = Field(description="Wear included.")
    ppk: IndexOut | None = Field(description="Of the tool that nobody corrects.")
    scatter: float = Field(description="Sigma from part to part about the wear.")
    ideal: IndexOut | None = Field(description="Cp of that scatter, centred: what an ideal correction could reach.")
    gain: float = Field(description="Spread without corrections, in spreads as it is.")
    price: float = Field(description="Spread as it is, in spreads of an ideal correction.")
    unknown: int = Field(description="Readings left out: nobody knows with which corrections they were cut.")


class InForceOut(BaseModel):
    """Parameters by which readings were judged."""

    version: int = Field(description="Version of the parameters.")
    target: float = Field(description="Size to aim at, mm.")
    half: float = Field(description="From the target to a limit: R35/2, or R35 from a natural limit.")
    readings: int = Field(description="Number of readings that were judged by it.")
    natural_limit: Literal["none", "lower", "upper"] = Field(description="The limit that no part can pass.")


class CapabilityOut(BaseModel):
    """Capability of a run of readings. What cannot be said of them is null, and `refused` or a text says why."""

    characteristic: str
    first_sequence: int | None
    last_sequence: int | None
    first_at: datetime | None = Field(description="When the first reading was measured.")
    last_at: datetime | None = Field(description="When the last reading was measured.")
    readings: int
    excluded: list[int] = Field(description="Sequences that somebody took out of the statistics; at most 1000.")
    probe_faults: list[int] = Field(description="Probe faults, which are no measurement of a part; at most 1000.")
    far: list[int] = Field(
        description="Readings far from all others (14 sigma of the bulk and more from the median): counted, but to be looked at; at most 1000."
    )
    lower_limit: float | None = Field(
        description="Limits of the deviation, of the newest reading's version; null for a natural one."
    )
    upper_limit: float | None = Field(description="The other limit of the deviation, mm; null for a natural one.")
    natural_limit: Literal["none", "lower", "upper"] = Field(
        description="The limit that no part can pass: it carries no index and no ppm."
    )
    one_sided: str | None = Field(description="Why `cp`, `pp` and `cpm` are null; null where both limits are judged.")
    versions: list[InForceOut] = Field(description="By which the readings were judged, the newest reading's last.")
    confidence: float = Field(description="Of the intervals, such as 0.95.")
    mean: float | None
    sigma_within: float | None = Field(description="Of Cp and Cpk.")
    sigma_by: SigmaBy = Field(
        description="What sigma within is made of: `neighbours` by their mean moving range / d2, else pooled inside parts, shifts or nests."
    )
    sigma_overall: float | None = Field(description="Standard deviation of all readings, mm, of Pp and Ppk.")
    quote: Literal["cpk", "ppk", "fitted", "percentile", "none"] = Field(description="Which number may be quoted.")
    quoted: "QuotedOut | None" = Field(
        description="That number with its window and method; null where `quote` is none."
    )
    why_none: str | None = Field(description="Why none may be quoted; null where one may.")
    cp: IndexOut | None = Field(description="The tolerance by 6 sigma within; null with one limit.")
    cpk: IndexOut | None = Field(description="To the nearer limit, by 3 sigma within.")
    pp: IndexOut | None = Field(description="The tolerance by 6 sigma overall; null with one limit.")
    ppk: IndexOut | None = Field(description="To the nearer limit, by 3 sigma overall.")
    cpm: IndexOut | None = Field(
        description="Cp that counts the distance from the target as well; null with one limit."
    )
    fitted: FittedOut | None = Field(
        description="Where the readings are not normal, or a natural limit has a distribution that fits better; of 100 readings and more."
    )
    percentiles: PercentileOut | None = Field(description="Of 100 readings and more.")
    ppm_within: FalloutOut | None = Field(description="Expected under a normal distribution with sigma within.")
    ppm_overall: FalloutOut | None = Field(description="The same with the sigma of all readings.")
    ppm_observed: FalloutOut | None = Field(description="Counted, each part by the tolerance in force.")
    outside: int = Field(description="Number of parts out of tolerance.")
    refused: str | None = Field(description="Why there is no index.")
    normal: bool = Field(description="Nothing speaks against a normal distribution.")
    normality: list[NormalityOut] = Field(description="The tests for that.")
    stable: bool | None = Field(
        description="In control and constant in time: Cp and Cpk may be quoted. null: too few readings to say."
    )
    in_control: bool | None = Field(
        description="By the run rules: no more signals than chance explains, none far beyond the limits."
    )
    constant_in_time: bool | None = Field(
        description="By the model in time (ISO 22514): mean and scatter are constant, model A1 or A2."
    )
    stability: str = Field(description="In words, whether the process is in control and constant in time.")
    baseline: int | None = Field(description="Version of the frozen baseline it was judged by; null: by themselves.")
    signals: list[FiredOut] = Field(description="Run rules that gave signals.")
    in_time: InTimeOut | None = Field(description="Of 50 readings and more.")
    tolerance_interval: ToleranceIntervalOut | None = Field(
        description="null of too few readings: of those that are not normal it takes so many that the extremes are enough."
    )
    compensated: bool = Field(
        description="Corrections were in effect: the indices are those of process and correction together."
    )
    without: WithoutOut | None = Field(description="Only where corrections were in effect.")
    cautions: list[str]


MOST_NAMED = 1000


def capability_out(study: Study) -> CapabilityOut:
    """The study as JSON."""
    result = None if isinstance(study.indices, Refused) else study.indices
    by_percentile = None if isinstance(study.by_percentile, Refused) else study.by_percentile
    model = None if isinstance(study.in_time, Refused) else study.in_time
    judged = None if isinstance(study.stability, Refused) else study.stability
    return answer_from(
        CapabilityOut,
        study,
        characteristic=study.current.characteristic.key,
        first_sequence=int(study.sequence[0]) if len(study.sequence) else None,
        last_sequence=int(study.sequence[-1]) if len(study.sequence) else None,
        readings=len(study.values),
        excluded=study.excluded[:MOST_NAMED],
        probe_faults=study.faults[:MOST_NAMED],
        far=study.far[:MOST_NAMED],
        lower_limit=study.limits.lower,
        upper_limit=study.limits.upper,
        one_sided=wording.one_sided(study),
        mean=result.mean if result else None,
        sigma_within=result.within.value if result else None,
        sigma_overall=result.overall.value if result else None,
        quoted=_quoted(study),
        why_none=wording.why_not(study.quoting.why) if study.quote == "none" else None,
        cp=IndexOut.of(result.cp if result else None),
        cpk=IndexOut.of(result.cpk if result else None),
        pp=IndexOut.of(result.pp if result else None),
        ppk=IndexOut.of(result.ppk if result else None),
        cpm=IndexOut.of(result.cpm if result else None),
        fitted=_fitted(study.by_fit, study.natural_limit) if isinstance(study.by_fit, Fitted) else None,
        percentiles=_percentiles(by_percentile) if by_percentile else None,
        ppm_within=FalloutOut.of(study.within, study.natural_limit),
        ppm_overall=FalloutOut.of(study.overall, study.natural_limit),
        ppm_observed=FalloutOut.of(study.fallout, study.natural_limit),
        refused=statistics.refusal(study.indices) if isinstance(study.indices, Refused) else None,
        normality=[
            NormalityOut.of("anderson_darling", study.anderson),
            NormalityOut.of("shapiro_wilk", study.shapiro),
        ],
        stability=wording.stability(study.stability, study.baseline),
        signals=judged.fired if judged else (),
        in_time=_in_time(study, model) if model else None,
        tolerance_interval=None if isinstance(study.tolerance, Refused) else study.tolerance,
        without=_without(study),
        cautions=wording.cautions(study),
    )


def _fit(fit: Fit) -> dict[str, Any]:
    return {"distribution": fit.family, "parameters": fit.named} | {
        name: getattr(fit, name) for name in ("statistic", "p_value", "criterion")
    }


def _fitted(found: Fitted, natural: NaturalLimit) -> FittedOut:
    return answer_from(
        FittedOut,
        found,
        **_fit(found.fit),
        ppk=IndexOut.of(found.ppk),
        ppm=FalloutOut.of(found.ppm, natural),
        why=fit_wording.reason(found),
        tried=[FitOut(**_fit(fit)) for fit in found.tried],
    )


def _percentiles(found: PercentileCapability) -> PercentileOut:
    return answer_from(PercentileOut, found, ppk=found.ppk.value, interval=IndexOut.of(found.ppk))


def _quoted(study: Study) -> QuotedOut | None:
    quoting = study.quoting
    if quoting.value is None or study.quote == "none":
        return None
    return answer_from(
        QuotedOut, quoting, index=study.quote, method=wording.method(study.quote), window=wording.window_of(study)
    )


def _in_time(study: Study, in_time: InTime) -> InTimeOut:
    return answer_from(
        InTimeOut,
        in_time,
        tests=[
            TestOut(question=question, test=test, numbers=numbers, answer=answer)
            for question, test, numbers, answer in wording.model_tests(in_time)
        ],
        text=wording.model(in_time),
        means=wording.model_means(study),
    )


def _without(study: Study) -> WithoutOut | None:
    process = study.without
    if process is None or isinstance(process, Refused):
        return None
    return answer_from(
        WithoutOut,
        process,
        standard_deviation=process.tool.value,
        ppk=IndexOut.of(process.ppk),
        scatter=process.ideal_sigma.value,
        ideal=IndexOut.of(process.ideal),
        unknown=study.unknown,
    )


def machine_performance_out(found: Run | Refused) -> MachinePerformanceOut:
    """The run as JSON."""
    if isinstance(found, Refused):
        nothing: dict[str, Any] = dict.fromkeys(MachinePerformanceOut.model_fields)
        nothing |= {"readings": found.have, "left_out": 0}
        return MachinePerformanceOut(**nothing | {"refused": machine_wording.no_run(found)})
    result = None if isinstance(found.result, Refused) else found.result
    fit = result.by_fit if result else None
    return MachinePerformanceOut(
        readings=len(found.values),
        first_sequence=int(found.sequence[0]),
        last_sequence=int(found.sequence[-1]),
        first_at=found.first_at,
        last_at=found.last_at,
        left_out=found.left_out,
        mean=result.mean if result else None,
        sigma=result.sigma if result else None,
        pm=IndexOut.of(result.pm if result else None),
        pmk=IndexOut.of(result.pmk if result else None),
        distribution=fit.fit.family if fit else None,
        refused=machine_wording.why_none(found),
    )
