"""More tables: what people and the daemon did with an axis, and what is kept as proof. See `models.py`."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ForeignKey, Index, LargeBinary, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from monitor.models import Base, Key, axis_key


class EventRow(Base):
    """Something a person or the daemon did to an axis: relubricated, repaired, learned anew."""

    __tablename__ = "event"
    __table_args__ = (Index("ix_event_axis_id_at_ns", "axis_id", "at_ns"),)
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    at_ns: Mapped[int] = mapped_column(comment="event time, ns")
    kind: Mapped[str]
    text: Mapped[str]
    author: Mapped[str]
    new_baseline: Mapped[bool] = mapped_column(comment="true: the watch learned anew from here on")


class AxisVersionRow(Base):
    """The constants and the extra effects of an axis' model from a time on."""

    __tablename__ = "axis_version"
    __table_args__ = (UniqueConstraint("axis_id", "version"),)
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    version: Mapped[int]
    from_ns: Mapped[int] = mapped_column(comment="first event time it holds for, ns")
    constants: Mapped[dict[str, Any]] = mapped_column(comment="of the axis file, SI")
    effects: Mapped[dict[str, Any]] = mapped_column(default=dict, comment="promoted effects with their parameters")
    author: Mapped[str]
    why: Mapped[str] = mapped_column(comment="what changed")


class DiagnosisRow(Base):
    """A diagnosis the daemon made of an axis' windows."""

    __tablename__ = "diagnosis"
    __table_args__ = (Index("ix_diagnosis_axis_id_at_ns", "axis_id", "at_ns"),)
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    at_ns: Mapped[int] = mapped_column(comment="event time of the newest window, ns")
    from_ns: Mapped[int] = mapped_column(comment="first sample looked at, ns")
    to_ns: Mapped[int] = mapped_column(comment="last sample looked at, ns")
    verdict: Mapped[str]
    result: Mapped[dict[str, Any]] = mapped_column(comment="the JSON of tribowatch diagnose")
    windows: Mapped[list[Any]] = mapped_column(comment="epoch, first_seq, samples of the windows")
    seed: Mapped[int]
    software: Mapped[str] = mapped_column(comment="tribowatch version")
    seconds: Mapped[float] = mapped_column(comment="what it took, s")


class EvidenceRow(Base):
    """Proof of an alert or a diagnosis: a zip that says what it contains, and can be replayed."""

    __tablename__ = "evidence"
    __table_args__ = (
        Index("ix_evidence_axis_id_at_ns", "axis_id", "at_ns"),
        Index("ix_evidence_transition_id", "transition_id"),
    )
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    axis_id: Mapped[int] = axis_key()
    transition_id: Mapped[int | None] = mapped_column(ForeignKey("transition.id", ondelete="CASCADE"))
    diagnosis_id: Mapped[int | None] = mapped_column(ForeignKey("diagnosis.id", ondelete="CASCADE"))
    at_ns: Mapped[int] = mapped_column(comment="event time, ns")
    kind: Mapped[str] = mapped_column(comment="of the alert, or diagnosis")
    sha256: Mapped[str] = mapped_column(comment="of blob")
    blob: Mapped[bytes] = mapped_column(LargeBinary, comment="zip")


class OutboxRow(Base):
    """A transition that a receiver outside is to be told, until it is."""

    __tablename__ = "outbox"
    __table_args__ = (
        UniqueConstraint("transition_id", "receiver"),
        Index("ix_outbox_delivered_ns_next_ns", "delivered_ns", "next_ns"),
    )
    id: Mapped[int] = mapped_column(Key, primary_key=True)
    transition_id: Mapped[int] = mapped_column(ForeignKey("transition.id", ondelete="CASCADE"))
    receiver: Mapped[str]
    tries: Mapped[int] = mapped_column(default=0, comment="1")
    next_ns: Mapped[int] = mapped_column(default=0, comment="wall clock of the next try, ns")
    delivered_ns: Mapped[int | None] = mapped_column(comment="wall clock, ns; null = not yet")
    last_error: Mapped[str] = mapped_column(default="")


class RollUpRow(Base):
    """What a span of time says of one parameter, so that a year draws as fast as a day."""

    __tablename__ = "roll_up"
    axis_id: Mapped[int] = mapped_column(ForeignKey("axis.id", ondelete="CASCADE"), primary_key=True)
    parameter: Mapped[str] = mapped_column(primary_key=True)
    span: Mapped[int] = mapped_column(primary_key=True, comment="length, ns")
    start_ns: Mapped[int] = mapped_column(primary_key=True, comment="a multiple of span, ns")
    last_ns: Mapped[int] = mapped_column(comment="latest answer in it, ns")
    count: Mapped[int] = mapped_column(comment="answers, 1")
    bounded: Mapped[int] = mapped_column(comment="of them with an interval, 1")
    mean: Mapped[float]
    min: Mapped[float]
    max: Mapped[float]
    low: Mapped[float | None] = mapped_column(comment="mean of the intervals' lower ends")
    high: Mapped[float | None] = mapped_column(comment="mean of the intervals' upper ends")
    unit: Mapped[str]


class OwnerRow(Base):
    """The daemon that may write an axis, where several share a site."""

    __tablename__ = "owner"
    axis_id: Mapped[int] = mapped_column(ForeignKey("axis.id", ondelete="CASCADE"), primary_key=True)
    member: Mapped[str] = mapped_column(comment="name of the daemon that claimed it last")
