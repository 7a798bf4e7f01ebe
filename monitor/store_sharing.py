"""The store's part for daemons that share axes: who may write an axis. The last claim holds; others are fenced off."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from sqlalchemy import Connection, delete, insert, select

from monitor.errors import FencedError
from monitor.models import AxisRow
from monitor.models_life import OwnerRow
from monitor.store_base import StoreBase


class SharingStore(StoreBase):
    """Claims, and the fence that every write of an axis passes. Without a member's name there is no fence."""

    member = ""

    def claim(self, member: str, axes: Collection[str]) -> None:
        """Make `member` the one that may write the axes named; whoever could until now is fenced off."""
        self.member = member
        with self._write() as db:
            ids = list(db.scalars(select(AxisRow.id).where(AxisRow.name.in_(axes))))
            db.execute(delete(OwnerRow).where(OwnerRow.axis_id.in_(ids)))
            if ids:
                db.execute(insert(OwnerRow), [{"axis_id": axis_id, "member": member} for axis_id in ids])

    def _fence(self, db: Connection, axis_ids: Iterable[int]) -> None:
        """Refuse to write axes that another member has claimed; the lock lasts until the transaction ends.

        Raises:
            FencedError: names them.
        """
        if not self.member or not (ids := set(axis_ids)):
            return
        taken = select(AxisRow.name, OwnerRow.member).join(OwnerRow, OwnerRow.axis_id == AxisRow.id)
        theirs = taken.where(OwnerRow.axis_id.in_(ids)).with_for_update(read=True, of=OwnerRow)
        lost = [(name, member) for name, member in db.execute(theirs) if member != self.member]
        if lost:
            name, member = lost[0]
            raise FencedError(f"{len(lost)} axes are watched by another daemon by now, {name!r} by {member!r}")
