"""Initial schema: axes, journal, gaps, windows, estimates, parameters, alarms and their audit.

Revision ID: 0001
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision: str | None = None
branch_labels = None
depends_on = None

KEY = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Create every table."""
    op.create_table(
        "axis",
        sa.Column("id", KEY, nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column(
            "listed", sa.Boolean(), nullable=False, comment="false: it streams, but the configuration does not list it"
        ),
        sa.Column("force_unit", sa.String(), nullable=False),
        sa.Column("position_unit", sa.String(), nullable=False),
        sa.Column("last_ns", sa.BigInteger(), nullable=True, comment="latest sample, ns"),
        sa.Column("samples", sa.BigInteger(), nullable=False, comment="received, 1"),
        sa.Column("missing", sa.BigInteger(), nullable=False, comment="known to be missing, 1"),
        sa.Column("stream", sa.JSON(), nullable=True, comment="StreamState: what the intake needs to go on"),
        sa.Column("rejected", sa.JSON(), nullable=False, comment="samples or payloads refused, by reason, 1"),
        sa.Column("drift", sa.JSON(), nullable=True, comment="DriftState: baseline and running sums"),
        sa.PrimaryKeyConstraint("id", name="pk_axis"),
        sa.UniqueConstraint("name", name="uq_axis_name"),
    )
    op.create_table(
        "alarm",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False, comment="ISA-18.2"),
        sa.Column("occurrence", sa.BigInteger(), nullable=False, comment="times raised, 1"),
        sa.Column("machine", sa.JSON(), nullable=False, comment="Alarm: what the state machine needs to go on"),
        sa.Column("alert", sa.JSON(), nullable=True, comment="latest alert as published"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_alarm_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_alarm"),
        sa.UniqueConstraint("axis_id", "kind", name="uq_alarm_axis_id_kind"),
    )
    op.create_table(
        "block",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("epoch", sa.BigInteger(), nullable=False),
        sa.Column("seq", sa.BigInteger(), nullable=False, comment="number of the first sample in its epoch"),
        sa.Column("n", sa.BigInteger(), nullable=False),
        sa.Column("is_force", sa.Boolean(), nullable=False, comment="drive is a force in N, else a torque in N*m"),
        sa.Column("t_ns", sa.LargeBinary(), nullable=False, comment="ns"),
        sa.Column("drive", sa.LargeBinary(), nullable=False, comment="N*m or N"),
        sa.Column("position", sa.LargeBinary(), nullable=False, comment="m or rad"),
        sa.Column("velocity", sa.LargeBinary(), nullable=True, comment="m/s or rad/s"),
        sa.Column("temperature", sa.LargeBinary(), nullable=True, comment="degC"),
        sa.Column("load", sa.LargeBinary(), nullable=True, comment="kg or 1"),
        sa.CheckConstraint("n > 0", name="ck_block_n"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_block_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_block"),
        sa.UniqueConstraint("axis_id", "epoch", "seq", name="uq_block_axis_id_epoch_seq"),
    )
    op.create_table(
        "gap",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("epoch", sa.BigInteger(), nullable=False),
        sa.Column("from_seq", sa.BigInteger(), nullable=False),
        sa.Column("to_seq", sa.BigInteger(), nullable=False),
        sa.Column("missing", sa.BigInteger(), nullable=False, comment="samples, 1"),
        sa.Column("from_ns", sa.BigInteger(), nullable=True, comment="last sample before, ns"),
        sa.Column("to_ns", sa.BigInteger(), nullable=False, comment="first sample after, ns"),
        sa.CheckConstraint("missing >= 0", name="ck_gap_missing"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_gap_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_gap"),
        sa.UniqueConstraint("axis_id", "epoch", "from_seq", "kind", name="uq_gap_axis_id_epoch_from_seq_kind"),
    )
    op.create_table(
        "transition",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("event", sa.String(), nullable=False),
        sa.Column("before", sa.String(), nullable=False),
        sa.Column("after", sa.String(), nullable=False),
        sa.Column("at_ns", sa.BigInteger(), nullable=False, comment="event time, ns"),
        sa.Column("author", sa.String(), nullable=False, comment="who, for an operator's command"),
        sa.Column("alert", sa.JSON(), nullable=False),
        sa.Column("published", sa.Boolean(), nullable=False, comment="false: to be told again after a restart"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_transition_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_transition"),
    )
    op.create_index("ix_transition_axis_id_at_ns", "transition", ["axis_id", "at_ns"])
    op.create_table(
        "window",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("epoch", sa.BigInteger(), nullable=False),
        sa.Column("first_seq", sa.BigInteger(), nullable=False),
        sa.Column("samples", sa.BigInteger(), nullable=False, comment="raw samples, 1"),
        sa.Column("start_ns", sa.BigInteger(), nullable=False, comment="first sample, ns"),
        sa.Column("end_ns", sa.BigInteger(), nullable=False, comment="last sample, ns"),
        sa.Column("done", sa.Boolean(), nullable=False, comment="true once its estimate is stored"),
        sa.CheckConstraint("samples > 0", name="ck_window_samples"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_window_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_window"),
        sa.UniqueConstraint(
            "axis_id", "epoch", "first_seq", "samples", name="uq_window_axis_id_epoch_first_seq_samples"
        ),
    )
    op.create_index("ix_window_done_axis_id", "window", ["done", "axis_id", "epoch", "first_seq"])
    op.create_table(
        "estimate",
        sa.Column("window_id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("start_ns", sa.BigInteger(), nullable=False, comment="event time of the first sample, ns"),
        sa.Column("end_ns", sa.BigInteger(), nullable=False, comment="event time of the last sample, ns"),
        sa.Column("verdict", sa.String(), nullable=False, comment="identified | not_informative | bad_data"),
        sa.Column("reason", sa.String(), nullable=True),
        sa.Column("criterion", sa.Double(), nullable=True, comment="eq. (4), 1"),
        sa.Column("held_out_criterion", sa.Double(), nullable=True, comment="eq. (4), 1"),
        sa.Column("method", sa.String(), nullable=False),
        sa.Column("evaluations", sa.BigInteger(), nullable=False),
        sa.Column("seed", sa.BigInteger(), nullable=False),
        sa.Column("software", sa.String(), nullable=False, comment="tribowatch version"),
        sa.Column("data_sha256", sa.String(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False, comment="what the identification took, s"),
        sa.Column("result", sa.JSON(), nullable=False, comment="the JSON of tribowatch identify"),
        sa.Column("curve", sa.JSON(), nullable=True, comment="friction F(v): speeds m/s, values and ci95 N"),
        sa.Column("conditions", sa.JSON(), nullable=False, comment="mean temperature degC, load, speed and travel"),
        sa.Column("drift", sa.JSON(), nullable=False, comment="drift indicators at this window"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_estimate_axis_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["window_id"], ["window.id"], name="fk_estimate_window_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("window_id", name="pk_estimate"),
    )
    op.create_index("ix_estimate_axis_id_end_ns", "estimate", ["axis_id", "end_ns"])
    op.create_table(
        "parameter",
        sa.Column("window_id", KEY, nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("end_ns", sa.BigInteger(), nullable=False, comment="ns"),
        sa.Column("value", sa.Double(), nullable=False),
        sa.Column("low", sa.Double(), nullable=True, comment="ci95"),
        sa.Column("high", sa.Double(), nullable=True, comment="ci95"),
        sa.Column("unit", sa.String(), nullable=False),
        sa.Column("identifiable", sa.Boolean(), nullable=False),
        sa.Column("at_bound", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_parameter_axis_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(["window_id"], ["window.id"], name="fk_parameter_window_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("window_id", "name", name="pk_parameter"),
    )
    op.create_index("ix_parameter_axis_id_name_end_ns", "parameter", ["axis_id", "name", "end_ns"])


def downgrade() -> None:
    """Drop every table."""
    for table in ("parameter", "estimate", "window", "transition", "gap", "block", "alarm", "axis"):
        op.drop_table(table)
