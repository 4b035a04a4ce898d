"""Geometric results of one machine, counted. Never writes."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.geometry.alignment.tables import Alignment
from app.geometry.geometric_form.tables import FormMeasurement
from app.geometry.rotary_axes.tables import KinematicsRun
from app.geometry.work_zero.tables import WorkZero


def results_of(session: Session, machine_id: int) -> list[int]:
    """The numbers of its work zeros, alignments, form measurements and runs of rotary axes."""
    return [
        session.scalar(select(func.count()).select_from(table).where(table.machine_id == machine_id)) or 0
        for table in (WorkZero, Alignment, FormMeasurement, KinematicsRun)
    ]
