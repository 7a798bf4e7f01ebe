"""Where a re-analysis keeps its answers: a history of its own, in a folder like a daemon's, that grows by windows."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.engine import make_url

from monitor.axis_versions import axis_of
from monitor.errors import QueryError
from monitor.estimate import Estimate
from monitor.identify_window import SOFTWARE
from monitor.query_raw import Answered, RawReader, StoredAxis
from monitor.samples import Outcome, WindowId
from monitor.store import Store
from monitor.store_records import AxisRecord, VersionRecord

DATABASE, NOTE = "tribowatch.db", "reanalysis.json"


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be identified again.

    Attributes:
        source: URL of the history.
        axes: names; none means all.
        since_ns: this far back from each axis' latest sample. [ns]
        from_ns, to_ns: windows that ended in between. [ns]
        present: with the model of today instead of the one that was in force.
    """

    source: str
    axes: tuple[str, ...] = ()
    since_ns: int | None = None
    from_ns: int | None = None
    to_ns: int | None = None
    present: bool = False

    def begin(self, axis: StoredAxis) -> int | None:
        """First end of a window. [ns]"""
        return axis.last_ns - self.since_ns if self.since_ns is not None and axis.last_ns else self.from_ns


class Target:
    """The history that the new answers go into."""

    def __init__(self, folder: Path, order: Order) -> None:
        """Make or open it.

        Raises:
            QueryError: the folder holds something else, or another re-analysis than `order` asks for.
        """
        self.url, note = f"sqlite:///{folder / DATABASE}", folder / NOTE
        told = {
            "source": make_url(order.source).render_as_string(hide_password=True),
            "model": "present" if order.present else "then",
            "software": SOFTWARE,
        }
        if note.exists():
            _same_order(note, told)
        elif (folder / DATABASE).exists():
            raise QueryError(f"{folder}: this is the history of a daemon; --into needs a folder of its own")
        folder.mkdir(parents=True, exist_ok=True)
        note.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
        self._store = Store(self.url)
        self._records: dict[str, AxisRecord] = {}
        self._reader = RawReader(self.url)

    def open(self, axes: list[StoredAxis]) -> None:
        """Make the axes of the history known, with all versions of their models."""
        kept = {axis.name: axis.versions for axis in self._reader.stored_axes()}
        latest = {axis.name: kept.get(axis.name) or {1: model_of_version(axis, 1)} for axis in axes}
        self._records = self._store.register(
            axis_of(name, versions[max(versions)].constants) for name, versions in latest.items()
        )
        for axis in axes:
            for number, version in axis.versions.items():
                if number > max(latest[axis.name]):
                    self._store.add_version(self._records[axis.name], version)

    def done(self, axis: str) -> set[WindowId]:
        """Windows of an axis that are answered."""
        return self._reader.answered_windows(self._records[axis].id)

    def keep(self, axis: str, answer: Estimate, version: int) -> None:
        """Store an answer."""
        record = self._records[axis]
        rows = self._store.windows_of(record.id, [answer.window.id])  # of a run that was killed between two steps
        record.last_ns = max(record.last_ns or 0, answer.window.end_ns)
        if not rows:
            rows = [(row, one) for _, row, one in self._store.commit([(record, Outcome(windows=[answer.window]))])]
        record.version = version
        self._store.save(record, rows[0][0], answer, [], [], [])

    def answer(self, axis: str, window: WindowId) -> Answered | None:
        """What is stored of a window."""
        return self._reader.answer(self._records[axis].id, window)

    def close(self) -> None:
        """Close it."""
        self._reader.close()
        self._store.close()


def _same_order(note: Path, told: dict[str, str]) -> None:
    try:
        before = dict(json.loads(note.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise QueryError(f"{note}: no note of a re-analysis ({error}); choose another folder") from None
    for name, value in told.items():
        if before.get(name) != value:
            raise QueryError(
                f"{note.parent}: holds a re-analysis with {name} {before.get(name)!r}, but {value!r} is asked for; "
                "choose another folder"
            )


def model_of_version(axis: StoredAxis, number: int) -> VersionRecord:
    """The version of an axis' model of that number; the latest before it where an old program kept none."""
    return axis.versions[max((one for one in axis.versions if one <= number), default=min(axis.versions))]
