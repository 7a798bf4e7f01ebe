"""The loop closed: what the model cannot explain is diagnosed, named, and, once promoted, part of the axis' model.

Belongs to the supervising thread; the work itself is done in the laboratory.
"""

from __future__ import annotations

import dataclasses

import structlog

from monitor.alarm_desk import AlarmDesk, Publish
from monitor.axis_run import AxisRun, model_of, travelling
from monitor.config import Config
from monitor.diagnosing import DiagnosisJob, diagnose_windows, identify_again, promotable
from monitor.drift import DriftState, Finding, Kind, indicators, judge
from monitor.errors import DatabaseError
from monitor.estimate import Estimate
from monitor.fleet import Fleet
from monitor.identify_window import Job
from monitor.laboratory import Laboratory
from monitor.mismatch_watch import holds_in, structure_of, told
from monitor.payloads import mismatch_payload
from monitor.samples import Samples, Window, WindowId
from monitor.store import Store
from monitor.store_records import DiagnosisRecord
from monitor.workers import window_seed

log = structlog.get_logger()


class Loop:
    """Diagnoses and re-identifications of all axes."""

    def __init__(
        self, config: Config, fleet: Fleet, store: Store, alarms: AlarmDesk, publish: Publish, laboratory: Laboratory
    ) -> None:
        """Work is given to `laboratory`."""
        self._config, self._fleet, self._store = config, fleet, store
        self._alarms, self._publish, self._laboratory = alarms, publish, laboratory
        for run in fleet:  # the daemon may have ended between a promotion and what it calls for
            run.remodel = run.axis is not None and not knows_its_model(run)
            self._recall(run)

    def _recall(self, run: AxisRun) -> None:
        """Go on with the finding of before a restart where its alarm stands."""
        known = run.alarms.get(Kind.MODEL_MISMATCH.value)
        if run.axis is not None and known is not None and known.alarm.active:
            diagnosis = self._store.latest_diagnosis(run.record.id)
            if diagnosis is not None:
                rows = self._store.windows_of(run.record.id, [WindowId(*one) for one in diagnosis.windows])
                run.mismatch.restore(diagnosis, [window for _, window in rows])

    def consider(self, run: AxisRun, estimate: Estimate, findings: list[Finding]) -> list[Finding]:
        """`findings` of an answer, with what a diagnosis has to say; asks for one where it is due."""
        if not estimate.informative or run.axis is None:
            return findings
        lacking = structure_of(run.drift) and run.drift.told is None
        force = estimate.conditions.get("latent_force", 0.0)
        if run.mismatch.note(estimate.window, holds_in(findings) or lacking, force):
            self._ask(run)
        latest = run.mismatch.latest
        if lacking and latest is not None and promotable(latest.result):
            standing = Finding(Kind.MODEL_MISMATCH, True, {"cause": "left-out physics", "since": "the beginning"})
            findings = [one for one in findings if one.kind is not Kind.MODEL_MISMATCH] + [standing]
        return [run.mismatch.add(one) if one.kind is Kind.MODEL_MISMATCH else one for one in findings]

    def _ask(self, run: AxisRun) -> None:
        """Have the latest windows diagnosed."""
        assert run.axis is not None
        read = [(window, self._read(run, window)) for window in run.mismatch.windows]
        kept = [(window, samples) for window, samples in read if samples is not None]
        if not kept:
            return
        windows, raw = tuple(window for window, _ in kept), tuple(samples for _, samples in kept)
        last = windows[-1].id
        seed = window_seed(self._config.seed, run.record.name, last.epoch, last.first_seq)
        job = DiagnosisJob(travelling(run.axis), windows, raw, seed)
        if self._laboratory.submit(f"diagnosis {run.record.id}", diagnose_windows, job):
            log.info("diagnosis begun", axis=run.record.name, windows=len(windows))

    def _read(self, run: AxisRun, window: Window) -> Samples | None:
        """Raw samples of a window, None where they are kept no more."""
        try:
            return self._store.read(run.record.id, window.id)
        except DatabaseError:
            return None

    def turn(self) -> None:
        """Take what the laboratory has done; begin what a changed model calls for."""
        for key, result in self._laboratory.collect():
            what, number = key.split()
            run = next((one for one in self._fleet if one.record.id == int(number)), None)
            if run is None:
                continue
            if isinstance(result, BaseException):
                if what == "diagnosis":
                    run.mismatch.fail()
                else:
                    log.warning("stored windows could not be identified again: the baseline is learned anew",
                                axis=run.record.name)  # fmt: skip
                    self._restart(run, DriftState())
                continue
            if what == "diagnosis":
                self._diagnosed(run, result)
            else:
                self._remodelled(run, *result)
        for run in self._fleet:
            if run.remodel and not self._laboratory.busy(f"model {run.record.id}"):
                run.remodel = False
                self._ask_again(run)

    def _diagnosed(self, run: AxisRun, diagnosis: DiagnosisRecord) -> None:
        """Store a diagnosis, bring the alarm up to date, tell."""
        if run.axis is None:
            return
        run.mismatch.take(diagnosis)
        number = self._store.add_diagnosis(run.record.id, diagnosis)
        name, words = run.record.name, told(diagnosis)
        log.warning("diagnosis", axis=name, verdict=diagnosis.verdict, finding=words["finding"])
        self._publish("mismatch", name, mismatch_payload(self._config.site, name, number, diagnosis, words))
        alarm = run.alarms.get(Kind.MODEL_MISMATCH.value)
        if alarm is None or not alarm.alarm.active:
            return
        evidence = dict((alarm.alert or {}).get("evidence", {})) | words
        touched, changes = self._alarms.observe(run, [Finding(Kind.MODEL_MISMATCH, True, evidence)], diagnosis.at_ns)
        self._alarms.tell(run, self._store.save_alarms(run.record.id, touched, changes), changes)

    # --- another model ------------------------------------------------------------------------------------

    def _ask_again(self, run: AxisRun) -> None:
        """Have the windows of the baseline, and the latest ones, identified with the model as it is now."""
        assert run.axis is not None
        made_of = run.drift.baseline.made_of if run.drift.baseline else ()
        ids = [WindowId(*one) for one in made_of] + [window.id for window in run.mismatch.windows]
        rows = self._store.windows_of(run.record.id, ids)
        run.mismatch.forget()
        jobs = []
        for row, window in rows:
            samples = self._read(run, window)
            if samples is not None:
                seed = window_seed(self._config.seed, run.record.name, window.id.epoch, window.id.first_seq)
                method = self._config.identification.method
                effects, start = model_of(run)
                job = Job(row, travelling(run.axis), window, samples, seed, method, effects=effects, start=start)
                jobs.append(job)
        if len(jobs) < self._config.drift.baseline_windows:
            log.warning("too few raw windows are kept: the baseline is learned anew", axis=run.record.name)
            self._restart(run, DriftState())
            return
        self._laboratory.submit(f"model {run.record.id}", _again, run.record.version, tuple(jobs))

    def _restart(self, run: AxisRun, state: DriftState) -> None:
        run.drift = state
        run.record.drift = state.to_dict()
        self._store.save_drift(run.record)

    def _remodelled(self, run: AxisRun, version: int, answers: list[tuple[int, Estimate]]) -> None:
        """The watch goes on from the stored windows as the new model sees them."""
        if version != run.record.version:  # changed again meanwhile
            run.remodel = True
            return
        before = run.drift.baseline
        state, told_of = DriftState(), []
        for row, estimate in answers:
            state, _ = judge(state, estimate, run.rule)
            told_of.append((row, estimate, indicators(state, estimate, run.rule)))
        if before is not None and state.baseline is not None:  # only windows a pace apart were asked again
            baseline = dataclasses.replace(state.baseline, steps_per_year=before.steps_per_year)
            state = dataclasses.replace(state, baseline=baseline)
        self._store.replace(run.record, told_of)
        self._restart(run, state)
        log.info("model changed", axis=run.record.name, effects=sorted(run.record.effects), windows=len(answers))


def _again(version: int, jobs: tuple[Job, ...]) -> tuple[int, list[tuple[int, Estimate]]]:
    return version, identify_again(jobs)


def knows_its_model(run: AxisRun) -> bool:
    """Whether the baseline was made with the effects that the model has now, no more and no less."""
    baseline = run.drift.baseline
    if baseline is None:
        return True
    return {name.split(".")[0] for name in baseline.extra if "." in name} == set(run.record.effects)
