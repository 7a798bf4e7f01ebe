"""Tables of the history. Times are integer nanoseconds of Unix time, UTC; rows never leave the store and `queries.py`.

A change here needs a migration in `migrations/versions/`; a test compares both.
"""

from __future__ import annotations

from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s",
    "pk": "pk_%(table_name)s",
}
Key = BigInteger().with_variant(Integer, "sqlite")  # SQLite counts rowids only in a column declared INTEGER


class Base(DeclarativeBase):
    """All tables; every constraint has a name, which batch migrations need."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map: ClassVar[dict[Any, Any]] = {int: BigInteger, dict[str, Any]: JSON, list[Any]: JSON}


def axis_key() -> Mapped[int]:
    """The column that says whose row this is; it goes when the axis goes."""
    return mapped_column(ForeignKey("axis.id", ondelete="CASCADE"))


class AxisRow(Base):
    """An axis that was listed or was heard."""

    __tablename__ = "axis"
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    listed: Mapped[bool] = mapped_column(comment="false: it streams, but the configuration does not list it")
    force_unit: Mapped[str] = mapped_column(default="N")
    position_unit: Mapped[str] = mapped_column(default="m")
    last_ns: Mapped[int | None] = mapped_column(comment="latest sample, ns")
    samples: Mapped[int] = mapped_column(default=0, comment="received, 1")
    missing: Mapped[int] = mapped_column(default=0, comment="known to be missing, 1")
    stream: Mapped[dict[str, Any] | None] = mapped_column(comment="StreamState: what the intake needs to go on")
    rejected: Mapped[dict[str, Any]] = mapped_column(default=dict, comment="samples or payloads refused, by reason, 1")
    drift: Mapped[dict[str, Any] | None] = mapped_column(comment="DriftState: baseline and running sums")
    verdicts: Mapped[dict[str, Any]] = mapped_column(default=dict, server_default="{}", comment="answers by verdict, 1")


class BlockRow(Base):
    """Journal: raw samples as received, until no window needs them. Arrays are little-endian int64 / float64."""

    __tablename__ = "block"
    __table_args__ = (UniqueConstraint("axis_id", "epoch", "seq"), CheckConstraint("n > 0", name="n"))
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    epoch: Mapped[int]
    seq: Mapped[int] = mapped_column(comment="number of the first sample in its epoch")
    n: Mapped[int]
    is_force: Mapped[bool] = mapped_column(comment="drive is a force in N, else a torque in N*m")
    t_ns: Mapped[bytes] = mapped_column(LargeBinary, comment="ns")
    drive: Mapped[bytes] = mapped_column(LargeBinary, comment="N*m or N")
    position: Mapped[bytes] = mapped_column(LargeBinary, comment="m or rad")
    velocity: Mapped[bytes | None] = mapped_column(LargeBinary, comment="m/s or rad/s")
    temperature: Mapped[bytes | None] = mapped_column(LargeBinary, comment="degC")
    load: Mapped[bytes | None] = mapped_column(LargeBinary, comment="kg or 1")


class GapRow(Base):
    """A break of the stream; `missing` samples of `epoch` from `from_seq` on were not received."""

    __tablename__ = "gap"
    __table_args__ = (
        UniqueConstraint("axis_id", "epoch", "from_seq", "kind"),
        CheckConstraint("missing >= 0", name="missing"),
    )
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    kind: Mapped[str]
    epoch: Mapped[int]
    from_seq: Mapped[int]
    to_seq: Mapped[int]
    missing: Mapped[int] = mapped_column(comment="samples, 1")
    from_ns: Mapped[int | None] = mapped_column(comment="last sample before, ns")
    to_ns: Mapped[int] = mapped_column(comment="first sample after, ns")


class WindowRow(Base):
    """A complete window; in the history once, whatever is killed when."""

    __tablename__ = "window"
    __table_args__ = (
        UniqueConstraint("axis_id", "epoch", "first_seq", "samples"),
        Index("ix_window_done_axis_id", "done", "axis_id", "epoch", "first_seq"),
        CheckConstraint("samples > 0", name="samples"),
    )
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    epoch: Mapped[int]
    first_seq: Mapped[int]
    samples: Mapped[int] = mapped_column(comment="raw samples, 1")
    start_ns: Mapped[int] = mapped_column(comment="first sample, ns")
    end_ns: Mapped[int] = mapped_column(comment="last sample, ns")
    done: Mapped[bool] = mapped_column(default=False, comment="true once its estimate is stored")


class EstimateRow(Base):
    """The answer to one window."""

    __tablename__ = "estimate"
    __table_args__ = (Index("ix_estimate_axis_id_end_ns_verdict", "axis_id", "end_ns", "verdict"),)
    window_id: Mapped[int] = mapped_column(ForeignKey("window.id", ondelete="CASCADE"), primary_key=True)
    axis_id: Mapped[int] = axis_key()
    start_ns: Mapped[int] = mapped_column(comment="event time of the first sample, ns")
    end_ns: Mapped[int] = mapped_column(comment="event time of the last sample, ns")
    verdict: Mapped[str] = mapped_column(comment="identified | not_informative | bad_data")
    reason: Mapped[str | None]
    criterion: Mapped[float | None] = mapped_column(comment="eq. (4), 1")
    held_out_criterion: Mapped[float | None] = mapped_column(comment="eq. (4), 1")
    method: Mapped[str]
    evaluations: Mapped[int]
    seed: Mapped[int]
    software: Mapped[str] = mapped_column(comment="tribowatch version")
    data_sha256: Mapped[str]
    seconds: Mapped[float] = mapped_column(comment="what the identification took, s")
    result: Mapped[dict[str, Any]] = mapped_column(comment="the JSON of tribowatch identify")
    curve: Mapped[dict[str, Any] | None] = mapped_column(comment="friction F(v): speeds m/s, values and ci95 N")
    conditions: Mapped[dict[str, Any]] = mapped_column(
        default=dict, comment="mean temperature degC, load, speed and travel"
    )
    drift: Mapped[list[Any]] = mapped_column(default=list, comment="drift indicators at this window")
    axis_version: Mapped[int] = mapped_column(default=1, server_default="1", comment="of the axis' constants and model")


class ParameterRow(Base):
    """One parameter of one estimate; carries axis and time so that a trend is one index range."""

    __tablename__ = "parameter"
    __table_args__ = (Index("ix_parameter_axis_id_name_end_ns", "axis_id", "name", "end_ns"),)
    window_id: Mapped[int] = mapped_column(ForeignKey("window.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    axis_id: Mapped[int] = axis_key()
    end_ns: Mapped[int] = mapped_column(comment="ns")
    value: Mapped[float]
    low: Mapped[float | None] = mapped_column(comment="ci95")
    high: Mapped[float | None] = mapped_column(comment="ci95")
    unit: Mapped[str]
    identifiable: Mapped[bool]
    at_bound: Mapped[bool]


class AlarmRow(Base):
    """The alarm of one kind of one axis, with its latest alert."""

    __tablename__ = "alarm"
    __table_args__ = (UniqueConstraint("axis_id", "kind"),)
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    kind: Mapped[str]
    state: Mapped[str] = mapped_column(comment="ISA-18.2")
    occurrence: Mapped[int] = mapped_column(default=0, comment="times raised, 1")
    machine: Mapped[dict[str, Any]] = mapped_column(comment="Alarm: what the state machine needs to go on")
    alert: Mapped[dict[str, Any] | None] = mapped_column(comment="latest alert as published")


class TransitionRow(Base):
    """Audit: one row per change of an alarm's state, with the alert as it was then."""

    __tablename__ = "transition"
    __table_args__ = (Index("ix_transition_axis_id_at_ns", "axis_id", "at_ns"),)
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    kind: Mapped[str]
    event: Mapped[str]
    before: Mapped[str]
    after: Mapped[str]
    at_ns: Mapped[int] = mapped_column(comment="event time, ns")
    author: Mapped[str] = mapped_column(default="", comment="who, for an operator's command")
    alert: Mapped[dict[str, Any]]
    published: Mapped[bool] = mapped_column(default=False, comment="false: to be told again after a restart")
