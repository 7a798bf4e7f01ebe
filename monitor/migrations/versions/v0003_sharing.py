"""Who may write an axis, where several daemons share a site.

Revision ID: 0003
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision: str | None = "0002"
branch_labels = None
depends_on = None

KEY = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the table; it is empty while a daemon is alone."""
    op.create_table(
        "owner",
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("member", sa.String(), nullable=False, comment="name of the daemon that claimed it last"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_owner_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("axis_id", name="pk_owner"),
    )


def downgrade() -> None:
    """Take it back."""
    op.drop_table("owner")
