"""Alarms in the daemon: findings and commands move them, the store keeps them, then subscribers are told."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import structlog

from monitor.alarms import AlarmRule, Event
from monitor.axis_run import AxisRun
from monitor.config import Config
from monitor.drift import Finding, Kind
from monitor.errors import QueryError
from monitor.evidence_keeper import EvidenceKeeper, risen_at
from monitor.judgement import apply, command, tick
from monitor.query_rows import transition_dict
from monitor.store import Store
from monitor.store_records import AlarmRecord, Change

log = structlog.get_logger()
Publish = Callable[[str, str, dict[str, Any]], None]


class AlarmDesk:
    """Belongs to the supervising thread."""

    def __init__(self, config: Config, store: Store, publish: Publish | None, wall: Callable[[], int]) -> None:
        """`wall` is Unix time [ns]: staleness has no event to take its time from. `publish` None = tell nobody yet."""
        self._config, self._store, self._publish, self._wall = config, store, publish, wall
        self.keeper = EvidenceKeeper(config, store)
        settings = config.alarms
        self._rule = AlarmRule(
            on_count=settings.on_windows,
            off_count=settings.off_windows,
            on_of=settings.on_of_windows,
            off_of=settings.off_of_windows,
            on_delay_ns=round(settings.on_delay * 1e9),
            off_delay_ns=round(settings.off_delay * 1e9),
        )

    def rule_of(self, kind: str) -> AlarmRule:
        """The rule of a kind of alarm; staleness has waited long enough when it is noticed."""
        rule = AlarmRule() if kind == Kind.STALE else self._rule
        return dataclasses.replace(rule, latch=kind in self._config.alarms.latch)

    def observe(self, run: AxisRun, findings: Iterable[Finding], now_ns: int) -> tuple[list[AlarmRecord], list[Change]]:
        """Let findings at event time `now_ns` [ns] move the alarms of an axis; gives what is to be stored."""
        name, wall_ns = run.record.name, self._wall()
        return apply(self._config.site, name, run.alarms, findings, now_ns, self.rule_of, wall_ns=wall_ns)

    def tick(self, run: AxisRun) -> None:
        """Let time pass for the alarms of an axis: shelving ends."""
        if not run.alarms:
            return
        wall_ns = self._wall()
        touched, changes = tick(run.alarms, self._now_ns(run), wall_ns, self.rule_of)
        if touched:
            self.tell(run, self._store.save_alarms(run.record.id, touched, changes), changes)

    def _now_ns(self, run: AxisRun, kind: str = "") -> int:
        """Event time of an axis [ns]; staleness has no event to take its time from."""
        return self._wall() if kind == Kind.STALE or run.record.last_ns is None else run.record.last_ns

    def tell(self, run: AxisRun, ids: list[int], changes: list[Change]) -> None:
        """Publish stored transitions, and note that they were."""
        if self._publish is None:
            return
        for number, change in zip(ids, changes, strict=True):
            row = {
                "id": number,
                "kind": change.record.kind,
                "event": change.transition.event.value,
                "before": change.transition.before.value,
                "after": change.transition.after.value,
                "at_ns": change.transition.at_ns,
                "author": change.author,
                "alert": change.record.alert,
            }
            self._publish("alerts", run.record.name, transition_dict(run.record.name, row))
            text = (change.record.alert or {}).get("text", "")
            log.warning("alert", kind=change.record.kind, state=change.transition.after.value, text=text)
        if ids:
            self._store.mark_told(ids)

    def tell_untold(self, names: Mapping[int, str]) -> None:
        """After a restart: publish what was stored but perhaps not told. `names` of our axes, by row."""
        if self._publish is None:
            return
        untold = [one for one in self._store.untold() if one[1] in names]
        for _, axis_id, row in untold:
            self._publish("alerts", names[axis_id], transition_dict(names[axis_id], row))
        if untold:
            self._store.mark_told([number for number, _, _ in untold])

    def watch_silence(self, run: AxisRun, silence: float) -> None:
        """Staleness is the one condition on the wall clock; missing data never resolve another alarm.

        Args:
            run: the axis; one that was never heard cannot fall silent.
            silence: since its latest message, or since the start. [s]
        """
        if run.axis is None or run.record.last_ns is None:
            return
        stale = silence >= self._config.intake.stale_after
        known = run.alarms.get(Kind.STALE.value)
        if stale == (known is not None and known.alarm.active) or (run.heard is None and not stale):
            return
        evidence = {"silent_ns": round(silence * 1e9), "last_ns": run.record.last_ns}
        finding, now_ns = Finding(Kind.STALE, stale, evidence if stale else {}), self._wall()
        touched, changes = apply(
            self._config.site,
            run.record.name,
            run.alarms,
            [finding],
            now_ns,
            self.rule_of,
            release_ns=self._now_ns(run),
        )
        self._settle(run, touched, changes, now_ns)

    def _settle(self, run: AxisRun, touched: list[AlarmRecord], changes: list[Change], now_ns: int) -> None:
        """Store what moved without a window, tell of it, and keep what it rests on."""
        ids = self._store.save_alarms(run.record.id, touched, changes)
        self.tell(run, ids, changes)
        self.keeper.keep(run, risen_at(touched, now_ns), ids, changes)

    def watch_quality(self, run: AxisRun) -> None:
        """Raise data_quality for an axis that sends and yet cannot be watched; its next good windows end it."""
        complaint = run.complaint
        known = run.alarms.get(Kind.DATA_QUALITY.value)
        if complaint is None or (known is not None and known.alarm.active):
            return
        finding = Finding(Kind.DATA_QUALITY, True, {"windows": 0, "reason": complaint})
        now_ns = run.record.last_ns or self._wall()
        touched, changes = self.observe(run, [finding], now_ns)
        self._settle(run, touched, changes, now_ns)

    def command(self, run: AxisRun, kind: str, event: Event, author: str, for_ns: int | None = None) -> bool:
        """An operator's command (acknowledge, shelve, ...); False where it changes nothing.

        Args:
            run: the axis.
            kind: of the alarm; one that was never raised can be put aside too.
            event: what to do.
            author: who does it.
            for_ns: with `SHELVE`, how long: by the axis' own time, and by the wall clock should its stream stop. [ns]

        Raises:
            QueryError: acknowledging an alarm that was never raised.
        """
        if kind not in run.alarms and event is Event.ACKNOWLEDGE:
            raise QueryError(f"axis {run.record.name!r} has no alarm {kind!r}")
        now_ns = self._now_ns(run, kind)
        ends = {} if for_ns is None else {"until_ns": now_ns + for_ns, "until_wall_ns": self._wall() + for_ns}
        before = run.alarms.get(kind) or AlarmRecord(kind)
        record, change = command(before, event, now_ns, self.rule_of(kind), author, **ends)
        if change is None:
            return False
        run.alarms[kind] = record
        self.tell(run, self._store.save_alarms(run.record.id, [record], [change]), [change])
        return True
