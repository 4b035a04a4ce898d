"""Signals as JSON."""

from datetime import datetime
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.quality.chart_signals import wording
from app.quality.chart_signals.queries import SignalRow
from app.quality.chart_signals.wording import Cause
from app.web.fields import Body, Reason, answer_from


class SignalOut(BaseModel):
    """A run of points that a rule has found. It is kept for good; while the run goes on, its end moves."""

    id: int
    state: Literal["open", "explained", "withdrawn"] = Field(
        description="explained: somebody has said what it was, here or by acknowledging its alarm. withdrawn: readings of it "
        "were taken out of the statistics, and what is left is no signal."
    )
    machine: str
    characteristic: str
    chart: Chart
    rule: RuleName = Field(description="nelson_1 on charts that know none but their limits.")
    side: Literal["above", "below", "rising", "falling"] | None = Field(description="null: the rule knows no side.")
    first_sequence: int = Field(description="The first reading of the run.")
    last_sequence: int
    points: int = Field(description="How many points make it.")
    text: str
    baseline: int = Field(description="The version of the baseline that it was judged by.")
    rules_version: int = Field(description="The version of the rules that found it.")
    at: datetime = Field(description="When it was found.")
    last_at: datetime = Field(description="When its run was last seen to go on.")
    alarm: int | None = Field(description="The alarm that it raised.")
    excluded: int = Field(description="Readings of the run that were taken out of the statistics since.")
    withdrawn_at: datetime | None = Field(description="When it was withdrawn; null: it stands.")
    explained_at: datetime | None = Field(description="When somebody explained it; null: nobody has.")
    explained_by: str | None = Field(description="Who explained it.")
    cause: Cause | None = Field(description="Kind of cause.")
    comment: str | None = Field(description="The explanation, in words.")


class CommentIn(Body):
    """Cause of a signal."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    cause: Cause
    comment: Reason


def signal_out(row: SignalRow) -> SignalOut:
    """A signal as it is answered."""
    signal, data = row.signal, wording.data_of(row.signal)
    answered = row.alarm is not None and row.alarm.acknowledged_at is not None and signal.explained_at is None
    return answer_from(
        SignalOut,
        signal,
        state=row.state,
        machine=row.machine.key,
        characteristic=row.characteristic.key,
        chart=Chart(signal.chart),
        rule=RuleName(signal.rule),
        side=_side(signal.rule, signal.side),
        text=wording.sentence(data),
        baseline=signal.baseline_version,
        explained_at=row.alarm.acknowledged_at if row.alarm and answered else signal.explained_at,
        explained_by=row.alarm.acknowledged_by if row.alarm and answered else signal.explained_by,
        cause=Cause(signal.cause) if signal.cause else None,
        comment=row.alarm.comment if row.alarm and answered else signal.comment,
    )


def _side(rule: str, side: int) -> str | None:
    if side == 0:
        return None
    if rule == RuleName.NELSON_3:
        return "rising" if side > 0 else "falling"
    return "above" if side > 0 else "below"
