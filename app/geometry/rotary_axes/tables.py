"""Runs of the preset compensation, what was decided of them, and the kinematics before and after. Lengths in mm, angles in degrees."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, ForeignKeyConstraint, Index, Sequence, func, text
from sqlalchemy.orm import Mapped, mapped_column

from app.db.base import Base

RUN_NUMBERS = Sequence("kinematics_run_id", metadata=Base.metadata)


class KinematicsRun(Base):
    """One run as it came out, refused ones too. Append-only: a trigger refuses to change it.

    Numbers are global, so that a run can be named without its machine.
    """

    __tablename__ = "kinematics_run"
    __table_args__ = (
        CheckConstraint("form IN ('touches', 'centres', 'results', 'protocol')", name="form"),
        CheckConstraint("outcome IN ('measured', 'too_large', 'refused')", name="outcome"),
        Index("kinematics_run_id_key", "id"),
        Index("kinematics_run_measured_idx", "machine_id", "measured_at", "id"),
        Index("kinematics_run_key_key", "machine_id", "key", unique=True, postgresql_where=text("key IS NOT NULL")),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, server_default=text("nextval('kinematics_run_id')"), autoincrement=False
    )
    form: Mapped[str]
    head: Mapped[str] = mapped_column(server_default="")  # the interchangeable head; empty: there is but one
    measured_at: Mapped[datetime]
    received_at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    key: Mapped[str | None]
    given: Mapped[dict[str, Any]]  # as it was sent: touches, centres, parameters, or the text of the protocol
    limits: Mapped[dict[str, Any]]  # maxModification, maxDevCalBall and ball radius as they were then
    outcome: Mapped[str]
    reason: Mapped[dict[str, Any]]  # a code with its values
    results: Mapped[dict[str, Any]]  # axes, offsets, what was not understood
    in_effect: Mapped[dict[str, Any]]  # what had been entered on the control by then, by name of the error
    version: Mapped[int]  # of the kinematics it was measured on; 0: nothing was entered yet


class KinematicsDecision(Base):
    """A run was confirmed (its change is larger than permitted) or entered on the control. Append-only."""

    __tablename__ = "kinematics_decision"
    __table_args__ = (
        ForeignKeyConstraint(["machine_id", "run"], ["kinematics_run.machine_id", "kinematics_run.id"]),
        CheckConstraint("what IN ('confirmed', 'entered')", name="what"),
    )

    machine_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    run: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    what: Mapped[str] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    actor: Mapped[str]
    reason: Mapped[str]


class KinematicsBackup(Base):
    """The kinematics of a machine (with one of its heads) as it was from one moment on, as cycle 450 keeps it. Append-only.

    errors: what has been entered so far, summed up by name. run: the run that led to it; restores: the version that was
    put back. since: runs measured from then on were measured on it; if the time of the entry is not known, that is when
    the last run was measured that was known by then.
    """

    __tablename__ = "kinematics_backup"

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    version: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    head: Mapped[str] = mapped_column(server_default="")
    at: Mapped[datetime] = mapped_column(server_default=func.now())
    since: Mapped[datetime]
    actor: Mapped[str]
    reason: Mapped[str]
    errors: Mapped[dict[str, Any]]
    run: Mapped[int | None] = mapped_column(BigInteger)
    restores: Mapped[int | None]


class KinematicsPlan(Base):
    """Limits of a machine's runs: of the control, of the drift, and the reference head.

    limits: by the name of a value, mm or degrees. characteristics: what values become readings of, by name.
    """

    __tablename__ = "kinematics_plan"
    __table_args__ = (
        CheckConstraint("ball_radius > 0", name="ball_radius"),
        CheckConstraint("max_modification > 0", name="max_modification"),
        CheckConstraint("max_modification_angle > 0", name="max_modification_angle"),
        CheckConstraint("max_dev_cal_ball > 0", name="max_dev_cal_ball"),
    )

    machine_id: Mapped[int] = mapped_column(ForeignKey("machine.id"), primary_key=True, autoincrement=False)
    ball_radius: Mapped[float | None]
    max_modification: Mapped[float | None]
    max_modification_angle: Mapped[float | None]
    max_dev_cal_ball: Mapped[float | None]
    reference_head: Mapped[str | None]
    limits: Mapped[dict[str, Any]] = mapped_column(server_default="{}")
    characteristics: Mapped[dict[str, Any]] = mapped_column(server_default="{}")
