"""When an alarm rises, what it rests on is kept. What goes wrong with that must not stop the watch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import structlog

from monitor.axis_run import AxisRun
from monitor.axis_versions import constants_of
from monitor.config import Config
from monitor.drift import DriftState, judge
from monitor.errors import DatabaseError
from monitor.estimate import Estimate
from monitor.evidence import pack
from monitor.evidence_fit import fit_of
from monitor.identify_window import SOFTWARE
from monitor.store import Store
from monitor.store_records import AlarmRecord, Change

log = structlog.get_logger()


class EvidenceKeeper:
    """Makes and stores the bundles. Belongs to the supervising thread."""

    def __init__(self, config: Config, store: Store) -> None:
        """Keep evidence in `store`."""
        self._config, self._store = config, store

    def keep(
        self,
        run: AxisRun,
        risen: Sequence[AlarmRecord],
        ids: Sequence[int],
        changes: Sequence[Change],
        window: tuple[Estimate, DriftState] | None = None,
    ) -> None:
        """Keep evidence of the alarms that have just risen.

        Args:
            run: the axis.
            risen: records of the alarms, with their alert.
            ids: rows of the transitions `changes`.
            changes: what was stored of them.
            window: the answer that raised them and the state of the watch before it; None for an alarm that rests on
                no window (staleness).
        """
        for record in risen:
            alert = record.alert or {}
            rows = [number for number, one in zip(ids, changes, strict=True) if one.record.kind == record.kind]
            try:
                blob = self._bundle(run, record, window)
                number = rows[-1] if rows else None
                self._store.add_evidence(run.record.id, int(alert["since_ns"]), record.kind, blob, transition_id=number)
            except DatabaseError:
                raise
            except Exception:
                log.exception("the evidence of an alert could not be kept", axis=run.record.name, kind=record.kind)

    def _bundle(self, run: AxisRun, record: AlarmRecord, window: tuple[Estimate, DriftState] | None) -> bytes:
        assert run.axis is not None
        manifest: dict[str, Any] = {
            "software": SOFTWARE,
            "alert": record.alert,
            "axis": {
                "name": run.record.name,
                "version": run.record.version,
                "effects": run.record.effects,
                "constants": constants_of(run.axis),
            },
        }
        if window is None:
            return pack(manifest, None)
        estimate, state = window
        samples = self._store.read(run.record.id, estimate.window.id)
        manifest["window"] = {
            "epoch": estimate.window.id.epoch,
            "first_seq": estimate.window.id.first_seq,
            "samples": estimate.window.id.samples,
            "start_ns": estimate.window.start_ns,
            "end_ns": estimate.window.end_ns,
            "is_force": samples.is_force,
        }
        manifest["job"] = {
            "seed": estimate.seed,
            "method": self._config.identification.method,
            "audit": "audit" in estimate.result,
        }
        manifest["answer"] = {
            "verdict": estimate.verdict,
            "reason": estimate.reason,
            "data_sha256": estimate.data_sha256,
            "parameters": {one.name: one.value for one in estimate.parameters},
            "result": estimate.result,
        }
        settings = {name: getattr(self._config, name).model_dump(mode="json") for name in ("drift", "alarms")}
        _, findings = judge(state, estimate, run.rule)
        holding = sorted(one.kind.value for one in findings if one.holds)
        manifest["watch"] = {"settings": settings, "state": state.to_dict(), "holding": holding}
        return pack(manifest, samples, fit_of(samples, run.axis, estimate))


def risen_at(touched: Sequence[AlarmRecord], at_ns: int) -> list[AlarmRecord]:
    """Those of the alarms that became true at event time `at_ns` [ns], shown or put aside."""
    return [one for one in touched if one.alert and one.alarm.active and int(one.alert["since_ns"]) == at_ns]
