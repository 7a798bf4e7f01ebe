"""Replay evidence: identify the kept window again and judge it again; does the same come out? Pure but for time."""

from __future__ import annotations

from typing import Any

from monitor.axis_run import drift_rule, model_from
from monitor.axis_versions import axis_of
from monitor.config import Config
from monitor.drift import DriftState, judge
from monitor.estimate import Estimate
from monitor.evidence import Bundle
from monitor.identify_window import SOFTWARE, Job, identify_window
from monitor.samples import Window, WindowId


def replay(bundle: Bundle) -> dict[str, Any]:
    """Compare what comes out now with what came out then.

    Returns:
        JSON: `same` (verdict of the window and of the watch), `differences` in words, both answers.
    """
    manifest = bundle.manifest
    alert = manifest["alert"]
    told = {"kind": alert["kind"], "alert": alert["id"], "software": {"then": manifest["software"], "now": SOFTWARE}}
    if bundle.samples is None:
        why = "this alert rests on no window: there is nothing to identify again"
        return {**told, "same": None, "differences": [], "why": why}
    window = manifest["window"]
    axis = axis_of(manifest["axis"]["name"], manifest["axis"]["constants"])
    identity = Window(
        WindowId(window["epoch"], window["first_seq"], window["samples"]), window["start_ns"], window["end_ns"]
    )
    settings = manifest["job"]
    effects, start = model_from(manifest["axis"]["effects"])
    job = Job(
        0, axis, identity, bundle.samples, settings["seed"], settings["method"], settings["audit"], effects, start
    )
    now = identify_window(job)
    rule = drift_rule(axis, Config(site=alert["site"], **manifest["watch"]["settings"]))
    _, findings = judge(DriftState.from_dict(manifest["watch"]["state"]), now, rule)
    holding = sorted(one.kind.value for one in findings if one.holds)
    differences = _differences(manifest, now, holding)
    largest = _largest(manifest["answer"]["parameters"], now)
    return {
        **told,
        "same": not differences,
        "differences": differences,
        "largest_parameter_difference": largest,
        "bit_for_bit": largest == 0.0,
        "verdict": {"then": manifest["answer"]["verdict"], "now": now.verdict},
        "holding": {"then": manifest["watch"]["holding"], "now": holding},
    }


def _differences(manifest: dict[str, Any], now: Estimate, holding: list[str]) -> list[str]:
    then = manifest["answer"]
    found = []
    if then["data_sha256"] != now.data_sha256:
        found.append("the samples are not those that were judged (data_sha256)")
    if then["verdict"] != now.verdict:
        found.append(f"verdict of the window: {then['verdict']} then, {now.verdict} now")
    if manifest["watch"]["holding"] != holding:
        before = ", ".join(manifest["watch"]["holding"]) or "nothing"
        found.append(f"the watch said {before} then, {', '.join(holding) or 'nothing'} now")
    return found


def _largest(then: dict[str, float], now: Estimate) -> float | None:
    """Largest relative difference of a parameter; None where there is none to compare. [1]"""
    values = {one.name: one.value for one in now.parameters}
    common = [name for name in then if name in values]
    gaps = [abs(values[name] - then[name]) / max(abs(then[name]), 1e-12) for name in common]
    return max(gaps, default=None)
