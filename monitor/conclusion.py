"""The way out: answer -> drift -> alarm -> history -> publication. Whatever is published was stored before."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import structlog

from monitor.alarm_desk import AlarmDesk, Publish
from monitor.axis_run import AxisRun
from monitor.config import Config
from monitor.drift import Finding, indicators, judge
from monitor.estimate import Estimate
from monitor.evidence_keeper import risen_at
from monitor.payloads import estimate_payload, model_payload
from monitor.room import Room
from monitor.store import Store

log = structlog.get_logger()


class Conclusion:
    """Judges the answers of all axes. Belongs to the supervising thread."""

    def __init__(
        self,
        config: Config,
        store: Store,
        alarms: AlarmDesk,
        publish: Publish,
        room: Room,
        consider: Callable[[AxisRun, Estimate, list[Finding]], list[Finding]],
    ) -> None:
        """Findings move `alarms`; answers are kept while there is `room`; `consider` adds what a diagnosis says."""
        self._config, self._store, self._alarms, self._publish = config, store, alarms, publish
        self._room, self._consider = room, consider

    def conclude(self, run: AxisRun, row: int, estimate: Estimate) -> None:
        """Judge one answer, store it with everything it changed, then tell."""
        before = run.drift
        findings, watched = self._judge(run, estimate)
        run.record.drift = run.drift.to_dict()
        name = run.record.name
        touched, changes = self._alarms.observe(run, findings, estimate.window.end_ns)
        ids = self._store.save(run.record, row, estimate, watched, touched, changes, keep=self._room.keeps())
        run.untidy = True
        self._publish("parameters", name, estimate_payload(self._config.site, name, estimate, watched))
        if estimate.verdict == "identified":
            self._publish("model", name, model_payload(self._config.site, name, estimate, run.axis))
        self._alarms.tell(run, ids, changes)
        risen = risen_at(touched, estimate.window.end_ns)
        if risen and not self._room.scarce:
            self._alarms.keeper.keep(run, risen, ids, changes, (estimate, before))

    def _judge(self, run: AxisRun, estimate: Estimate) -> tuple[list[Finding], list[dict[str, Any]]]:
        """Drift; an error of ours there must not cost the answer, nor stop the other axes."""
        try:
            run.audit.hear(estimate)
            run.drift, findings = judge(run.drift, estimate, run.rule)
            findings = self._consider(run, estimate, run.audit.quality(findings))
            return _with_pace(run, findings), indicators(run.drift, estimate, run.rule)
        except Exception:
            run.reject("judgement_error")
            log.exception("an answer could not be judged", axis=run.record.name, window=str(estimate.window.id))
            return [], []


def _with_pace(run: AxisRun, findings: list[Finding]) -> list[Finding]:
    """While the hop is stretched, an alert says that it rests on fewer windows than usual."""
    if run.assembler is None or run.assembler.stretch == 1:
        return findings
    pace = {"hop_stretched": run.assembler.stretch}
    return [dataclasses.replace(one, evidence=one.evidence | pace) if one.holds else one for one in findings]
