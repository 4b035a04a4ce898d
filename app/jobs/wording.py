"""Periodic jobs in words."""

from collections.abc import Sequence

from app.jobs.tables import JobFailure
from app.language.i18n import _


def job_word(name: str) -> str:
    """One line about the work of a job; its name if the job is of another version."""
    return {
        "corrections_expire": _("Expired corrections are withdrawn"),
        "gains": _("Gain of corrections"),
        "disagreements": _("Characteristics that disagree"),
        "tool_lives": _("Tool life alarms"),
        "wear_and_hunting": _("Wear forecast and over-correction"),
        "calibrations_due": _("Calibrations due"),
        "old_reports": _("Old reports are deleted"),
        "run_rules": _("Run rules of control charts"),
        "capability_verdicts": _("Capability for the overview"),
        "results_become_readings": _("Results become readings"),
        "connections": _("Bridges that are silent or back up"),
        "making_reports": _("Making reports"),
    }.get(name, name)


def link_of(subject: str) -> str | None:
    """The page of what a unit of work concerns."""
    kind, _slash, rest = subject.partition("/")
    if kind == "characteristic":
        return f"/characteristics/{rest}"
    if kind in {"tool", "correction", "calibration-plan"}:
        return f"/plant/{rest.partition('/')[0]}"
    if kind == "connection":
        return f"/machines/{rest.partition('/')[0]}/connection"
    return "/reports" if kind == "reports" else None


def with_job_words(failures: Sequence[JobFailure]) -> list[tuple[JobFailure, str]]:
    """Failures, each with the words of its job."""
    return [(failure, job_word(failure.job)) for failure in failures]
