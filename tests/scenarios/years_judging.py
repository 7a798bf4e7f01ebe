"""Were the alarms of healthy machines right? The history of `daemon_years` against what truly happened."""

from __future__ import annotations

import collections
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2
from sqlalchemy import select

from monitor.alarms import AlarmRule, Event, advance
from monitor.axis_run import drift_rule
from monitor.config import Config
from monitor.database import make_engine
from monitor.drift import DriftState, judge
from monitor.estimate import Curve, Estimate, Parameter
from monitor.models import AxisRow, EstimateRow, WindowRow
from monitor.queries import Reader
from monitor.store_records import AlarmRecord
from monitor.windows import Window, WindowId
from plant.scenario import unix_ns
from tests.scenarios.years_machines import START, Machine

DAY_NS = 86_400 * 10**9
BEGIN_NS = unix_ns(START)
SETTINGS = (0.3, 1.0, 3.0)
EDGE = 1.0  # d around a payload that still count as with it: windows are 11 h apart
FIRST = "friction_at_mid_speed"  # trended from the first window after the baseline on


def day_of(t_ns: int) -> float:
    """Days since the beginning."""
    return (t_ns - BEGIN_NS) / DAY_NS


def verdict(machine: Machine, kind: str, at_ns: int, alert: dict[str, Any]) -> tuple[str, str]:
    """`false`, `right` or `fair`, and why. Fair is a notice that says truly what the baseline does not know."""
    day, evidence = day_of(at_ns), alert.get("evidence") or {}
    begin = day_of(int(evidence["since_ns"])) if evidence.get("since_ns") else day
    carried = [mass for first, last, mass in machine.loads if first - EDGE <= day and begin <= last + EDGE]
    if kind != "operating_point":
        return "false", f"payload {sum(carried):.1f} kg, taken for {kind}" if carried else "nothing had happened"
    if carried:
        return "right", f"payload {sum(carried):.1f} kg, {'sent' if 'load' in machine.reports else 'not sent'}"
    if evidence.get("cause") == "not covered":
        beyond = [
            f"{name} {value:.1f} beyond {evidence['covered'][name]}"
            for name, value in evidence["conditions"].items()
            if not evidence["covered"][name][0] <= value <= evidence["covered"][name][1]
        ]
        if beyond:
            return "fair", "; ".join(beyond)
    return "false", "no payload, nothing beyond the baseline"


def poisson(count: int, years: float) -> list[float]:
    """95 % interval of a rate, exact (Garwood 1936). [1/a]"""
    low = chi2.ppf(0.025, 2 * count) / 2 if count else 0.0
    return [float(low / years), float(chi2.ppf(0.975, 2 * count + 2) / 2 / years)]


def rate_of(count: int, years: float) -> dict[str, Any]:
    return {"alarms": count, "per_axis_year": count / years, "ci95": poisson(count, years)}


def report(folder: Path, machines: list[Machine], rate: float) -> dict[str, Any]:
    """Everything that was raised, judged; rates with intervals."""
    url = f"sqlite:///{folder / 'var' / 'tribowatch.db'}"
    years, alarms, counts = 0.0, [], collections.Counter()
    without = []
    with Reader(url) as reader:
        for machine in machines:
            watched = _watched(reader, machine)
            years += watched / 365.25
            if not watched:
                without.append(machine.name)
            summary = reader.axis(machine.name)
            counts.update(summary.verdicts)
            counts.update({"missing samples": summary.missing, "gaps": summary.gaps})
            for one in reader.transitions(machine.name, limit=20_000):
                if one["transition"]["after"] == "unacknowledged":
                    at_ns = int(one["transition"]["at_ns"])
                    judged, why = verdict(machine, one["kind"], at_ns, one["alert"])
                    told = {
                        "axis": machine.name,
                        "day": day_of(at_ns),
                        "kind": one["kind"],
                        "judged": judged,
                        "why": why,
                    }
                    alarms.append({**told, "machine": machine.family.name, "text": one["alert"]["text"]})
        kpi = reader.alarm_figures()
    false = [one for one in alarms if one["judged"] == "false"]
    by_axis = collections.Counter(one["axis"] for one in false)
    return {
        "setting": rate,
        "axes": len(machines),
        "axis_years": years,
        "counts": dict(counts),
        "without_baseline": without,
        "raised": dict(collections.Counter(f"{one['kind']} {one['judged']}" for one in alarms)),
        "false": rate_of(len(false), years),
        "false_by_kind": {kind: rate_of(n, years) for kind, n in collections.Counter(o["kind"] for o in false).items()},
        "worst_axis": by_axis.most_common(1),
        "same_answers_at": {str(one): again(url, machines, one, years) for one in SETTINGS},
        "alarms": alarms,
        "kpi": kpi,
        "machines": [one.told() for one in machines],
    }


def _watched(reader: Reader, machine: Machine) -> float:
    """Days with a baseline, pauses excluded. [d]"""
    try:
        first = next(iter(reader.answers(machine.name, parameter=FIRST)), None)
    except Exception:
        return 0.0
    if first is None:
        return 0.0
    begin, end = day_of(first["t_ns"]), machine.scenario.bursts.days
    off = sum(max(0.0, min(last, end) - max(start, begin)) for start, last in machine.pauses)
    return end - begin - off


# --- the same answers at other settings ---------------------------------------------------------------------------


def again(url: str, machines: list[Machine], rate: float, years: float) -> dict[str, Any]:
    """What the watch as it is now would have raised from the stored answers at another setting."""
    told = [one for machine in machines for one in raised(machine, answers_of(url, machine.name), rate)]
    false = collections.Counter(one["kind"] for one in told if one["judged"] == "false")
    return rate_of(false.total(), years) | {"by_kind": dict(false)}


def raised(machine: Machine, answers: Iterable[Estimate], rate: float) -> Iterator[dict[str, Any]]:
    """Every alarm the watch as it is now raises from these answers, judged; each is acknowledged at once."""
    config = Config(site="study", alarms={"false_alarms_per_axis_year": rate})
    state, rule = DriftState(), drift_rule(machine.scenario.axis, config)
    alarms: dict[str, AlarmRecord] = {}
    settings = AlarmRule(off_count=config.alarms.off_windows)
    for one in answers:
        state, findings = judge(state, one, rule)
        for finding in findings:
            kind, now = finding.kind.value, one.window.end_ns
            record = alarms.get(kind) or AlarmRecord(kind)
            moved, change = advance(record.alarm, Event.HOLDS if finding.holds else Event.GONE, now, settings)
            if change is not None and change.after == "unacknowledged":
                judged, why = verdict(machine, kind, now, {"evidence": finding.evidence})
                yield {"axis": machine.name, "day": day_of(now), "kind": kind, "judged": judged, "why": why,
                       "evidence": finding.evidence}  # fmt: skip
                moved, _ = advance(moved, Event.ACKNOWLEDGE, now, settings)
            alarms[kind] = AlarmRecord(kind, moved)


def answers_of(url: str, axis: str) -> list[Estimate]:
    """The stored answers of an axis as the watch took them, in order; faults of samples are not stored."""
    engine = make_engine(url, read_only=True)
    query = (
        select(EstimateRow.__table__, WindowRow.epoch, WindowRow.first_seq, WindowRow.samples)
        .join(WindowRow, WindowRow.id == EstimateRow.window_id)
        .join(AxisRow, AxisRow.id == EstimateRow.axis_id)
        .where(AxisRow.name == axis)
        .order_by(WindowRow.id)
    )
    with engine.begin() as db:
        rows = db.execute(query).mappings().all()
    engine.dispose()
    return [_estimate(row) for row in rows]


def _estimate(row: Any) -> Estimate:
    parameters = tuple(
        Parameter(name, one["value"], one["unit"], *(one["ci95"] or (None, None)), one["identifiable"], one["at_bound"])
        for name, one in (row["result"].get("parameters") or {}).items()
        if one["value"] is not None and np.isfinite(one["value"])
    )
    identity = WindowId(row["epoch"], row["first_seq"], row["samples"])
    return Estimate(
        Window(identity, row["start_ns"], row["end_ns"]), row["verdict"], row["reason"], row["method"], row["seed"],
        row["software"], row["data_sha256"], row["result"], parameters=parameters,
        curve=Curve.from_dict(row["curve"]) if row["curve"] else None, conditions=row["conditions"],
    )  # fmt: skip
