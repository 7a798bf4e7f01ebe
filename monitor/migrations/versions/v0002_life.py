"""Events, versions of an axis, diagnoses, evidence, outbox, roll-ups; answers carry the version of their model.

Revision ID: 0002
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision: str | None = "0001"
branch_labels = None
depends_on = None

KEY = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
SPANS = (3_600 * 10**9, 86_400 * 10**9)  # ns: those of monitor.roll_ups when this was written
FILL = """
insert into roll_up (axis_id, parameter, span, start_ns, last_ns, count, bounded, mean, min, max, low, high, unit)
select axis_id, name, {span}, end_ns / {span} * {span}, max(end_ns), count(*), count(low),
       avg(value), min(value), max(value), avg(low), avg(high), min(unit)
from parameter group by axis_id, name, end_ns / {span}
"""


def upgrade() -> None:
    """Make the new tables, and fill those that follow from old ones."""
    _people()
    _proof()
    _roll_ups()
    verdicts = sa.Column("verdicts", sa.JSON(), server_default="{}", nullable=False, comment="answers by verdict, 1")
    op.add_column("axis", verdicts)
    version = sa.Column(
        "axis_version",
        sa.BigInteger(),
        server_default="1",
        nullable=False,
        comment="of the axis' constants and model",
    )
    op.add_column("estimate", version)
    op.drop_index("ix_estimate_axis_id_end_ns", "estimate")
    op.create_index("ix_estimate_axis_id_end_ns_verdict", "estimate", ["axis_id", "end_ns", "verdict"])
    _count_verdicts()
    for span in SPANS:
        op.execute(FILL.format(span=span))


def _people() -> None:
    op.create_table(
        "event",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("at_ns", sa.BigInteger(), nullable=False, comment="event time, ns"),
        sa.Column("kind", sa.String(), nullable=False),
        sa.Column("text", sa.String(), nullable=False),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("new_baseline", sa.Boolean(), nullable=False, comment="true: the watch learned anew from here on"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_event_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_event"),
    )
    op.create_index("ix_event_axis_id_at_ns", "event", ["axis_id", "at_ns"])
    op.create_table(
        "axis_version",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("version", sa.BigInteger(), nullable=False),
        sa.Column("from_ns", sa.BigInteger(), nullable=False, comment="first event time it holds for, ns"),
        sa.Column("constants", sa.JSON(), nullable=False, comment="of the axis file, SI"),
        sa.Column("effects", sa.JSON(), nullable=False, comment="promoted effects with their parameters"),
        sa.Column("author", sa.String(), nullable=False),
        sa.Column("why", sa.String(), nullable=False, comment="what changed"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_axis_version_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_axis_version"),
        sa.UniqueConstraint("axis_id", "version", name="uq_axis_version_axis_id_version"),
    )


def _proof() -> None:
    op.create_table(
        "diagnosis",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("at_ns", sa.BigInteger(), nullable=False, comment="event time of the newest window, ns"),
        sa.Column("from_ns", sa.BigInteger(), nullable=False, comment="first sample looked at, ns"),
        sa.Column("to_ns", sa.BigInteger(), nullable=False, comment="last sample looked at, ns"),
        sa.Column("verdict", sa.String(), nullable=False),
        sa.Column("result", sa.JSON(), nullable=False, comment="the JSON of tribowatch diagnose"),
        sa.Column("windows", sa.JSON(), nullable=False, comment="epoch, first_seq, samples of the windows"),
        sa.Column("seed", sa.BigInteger(), nullable=False),
        sa.Column("software", sa.String(), nullable=False, comment="tribowatch version"),
        sa.Column("seconds", sa.Double(), nullable=False, comment="what it took, s"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_diagnosis_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("id", name="pk_diagnosis"),
    )
    op.create_index("ix_diagnosis_axis_id_at_ns", "diagnosis", ["axis_id", "at_ns"])
    op.create_table(
        "evidence",
        sa.Column("id", KEY, nullable=False),
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("transition_id", KEY, nullable=True),
        sa.Column("diagnosis_id", KEY, nullable=True),
        sa.Column("at_ns", sa.BigInteger(), nullable=False, comment="event time, ns"),
        sa.Column("kind", sa.String(), nullable=False, comment="of the alert, or diagnosis"),
        sa.Column("sha256", sa.String(), nullable=False, comment="of blob"),
        sa.Column("blob", sa.LargeBinary(), nullable=False, comment="zip"),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_evidence_axis_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(
            ["transition_id"], ["transition.id"], name="fk_evidence_transition_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["diagnosis_id"], ["diagnosis.id"], name="fk_evidence_diagnosis_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_evidence"),
    )
    op.create_index("ix_evidence_axis_id_at_ns", "evidence", ["axis_id", "at_ns"])
    op.create_index("ix_evidence_transition_id", "evidence", ["transition_id"])
    op.create_table(
        "outbox",
        sa.Column("id", KEY, nullable=False),
        sa.Column("transition_id", KEY, nullable=False),
        sa.Column("receiver", sa.String(), nullable=False),
        sa.Column("tries", sa.BigInteger(), nullable=False, comment="1"),
        sa.Column("next_ns", sa.BigInteger(), nullable=False, comment="wall clock of the next try, ns"),
        sa.Column("delivered_ns", sa.BigInteger(), nullable=True, comment="wall clock, ns; null = not yet"),
        sa.Column("last_error", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(
            ["transition_id"], ["transition.id"], name="fk_outbox_transition_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_outbox"),
        sa.UniqueConstraint("transition_id", "receiver", name="uq_outbox_transition_id_receiver"),
    )
    op.create_index("ix_outbox_delivered_ns_next_ns", "outbox", ["delivered_ns", "next_ns"])


def _roll_ups() -> None:
    op.create_table(
        "roll_up",
        sa.Column("axis_id", KEY, nullable=False),
        sa.Column("parameter", sa.String(), nullable=False),
        sa.Column("span", sa.BigInteger(), nullable=False, comment="length, ns"),
        sa.Column("start_ns", sa.BigInteger(), nullable=False, comment="a multiple of span, ns"),
        sa.Column("last_ns", sa.BigInteger(), nullable=False, comment="latest answer in it, ns"),
        sa.Column("count", sa.BigInteger(), nullable=False, comment="answers, 1"),
        sa.Column("bounded", sa.BigInteger(), nullable=False, comment="of them with an interval, 1"),
        sa.Column("mean", sa.Double(), nullable=False),
        sa.Column("min", sa.Double(), nullable=False),
        sa.Column("max", sa.Double(), nullable=False),
        sa.Column("low", sa.Double(), nullable=True, comment="mean of the intervals' lower ends"),
        sa.Column("high", sa.Double(), nullable=True, comment="mean of the intervals' upper ends"),
        sa.Column("unit", sa.String(), nullable=False),
        sa.ForeignKeyConstraint(["axis_id"], ["axis.id"], name="fk_roll_up_axis_id", ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("axis_id", "parameter", "span", "start_ns", name="pk_roll_up"),
    )


def _count_verdicts() -> None:
    """Every axis carries the number of its answers by verdict, so that an overview does not count them."""
    axis = sa.table("axis", sa.column("id"), sa.column("verdicts", sa.JSON))
    connection = op.get_bind()
    counted: dict[int, dict[str, int]] = {}
    query = sa.text("select axis_id, verdict, count(*) from estimate group by axis_id, verdict")
    for axis_id, verdict, count in connection.execute(query):
        counted.setdefault(axis_id, {})[verdict] = int(count)
    for axis_id, verdicts in counted.items():
        connection.execute(axis.update().where(axis.c.id == axis_id).values(verdicts=verdicts))


def downgrade() -> None:
    """Back to 0001; what only the new tables hold is lost."""
    for table in ("roll_up", "outbox", "evidence", "diagnosis", "axis_version", "event"):
        op.drop_table(table)
    op.drop_index("ix_estimate_axis_id_end_ns_verdict", "estimate")
    op.create_index("ix_estimate_axis_id_end_ns", "estimate", ["axis_id", "end_ns"])
    with op.batch_alter_table("estimate") as batch:
        batch.drop_column("axis_version")
    with op.batch_alter_table("axis") as batch:
        batch.drop_column("verdicts")
