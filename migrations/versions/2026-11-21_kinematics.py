"""Kinematics of machines, runs of the preset compensation, back-ups.

Revision ID: 0017
Revises: 0016
Create Date: 2026-11-21
"""

revision = "0017"
down_revision: str | None = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
