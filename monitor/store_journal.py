"""Which raw samples of an axis may still be needed; see `store.py`."""

from __future__ import annotations

from sqlalchemy import Connection, func, select

from monitor.models import BlockRow, WindowRow


def first_needed(db: Connection, axis_id: int, needed_from: tuple[int, int], keep_windows: int) -> int | None:
    """Row of the oldest block that is needed, in the order of arrival, which epochs need not keep; None for none.

    Args:
        db: a transaction.
        axis_id: row of the axis.
        needed_from: (epoch, number) of the first sample that a future window needs.
        keep_windows: so many of the newest windows with an answer are needed too.
    """
    windows = select(WindowRow.epoch, WindowRow.first_seq).where(WindowRow.axis_id == axis_id)
    waiting = windows.where(WindowRow.done.is_(False)).order_by(WindowRow.id).limit(1)
    needed = [needed_from, *(tuple(row) for row in db.execute(waiting))]
    ours = select(BlockRow.id).where(BlockRow.axis_id == axis_id)
    newest = func.max(BlockRow.id)
    epochs = select(BlockRow.epoch, newest).where(BlockRow.axis_id == axis_id).group_by(BlockRow.epoch)
    for epoch, _ in db.execute(epochs.order_by(newest.desc())).all() if keep_windows else ():
        done = windows.where(WindowRow.done.is_(True), WindowRow.epoch == epoch)
        kept = db.execute(done.order_by(WindowRow.first_seq.desc()).limit(keep_windows)).all()
        needed += [tuple(row) for row in kept[-1:]]
        keep_windows -= len(kept)
        if not keep_windows:
            break
    else:
        if keep_windows:  # all there are
            return 0
    rows = [
        db.scalar(ours.where(BlockRow.epoch == epoch, BlockRow.seq + BlockRow.n > seq).order_by(BlockRow.seq).limit(1))
        for epoch, seq in needed
    ]
    return min((row for row in rows if row is not None), default=None)
