"""`/metrics` in the Prometheus text format: names and units after its conventions, labels of bounded number only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, InfoMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from monitor.board import BOUNDS, Board

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
P = "tribowatch_"
FRICTION = {"N": "newtons", "N*m": "newton_metres"}  # unit of Coulomb friction -> end of its name


def metrics_text(fleet: dict[str, Any], state: dict[str, Any], board: Board, answered: dict[str, int]) -> bytes:
    """Everything, as Prometheus reads it.

    Args:
        fleet: answer of `/fleet`.
        state: answer of `/status`.
        board: what the daemon last said.
        answered: HTTP answers by class of their status.
    """
    registry = CollectorRegistry()
    registry.register(_Now([*_of_daemon(state, board, answered), *_of_axes(fleet["axes"])]))
    ProcessCollector(registry=registry)
    return generate_latest(registry)


class _Now(Collector):
    """Hands out metrics that were already counted."""

    def __init__(self, metrics: list[Metric]) -> None:
        self._metrics = metrics

    def collect(self) -> Iterator[Metric]:
        yield from self._metrics


def _of_daemon(state: dict[str, Any], board: Board, answered: dict[str, int]) -> Iterator[Metric]:
    yield InfoMetricFamily(
        f"{P}build", "version of the daemon", {"version": state["version"], "python": state["python"]}
    )
    yield _gauge("uptime_seconds", "since the daemon's start", state["uptime_seconds"])
    yield _gauge("loop_silence_seconds", "since the supervising thread last came round", state["silence_seconds"])
    yield _gauge("inbox_blocks", "blocks received and not yet looked at", state["inbox_blocks"])
    yield _gauge("backlog_windows", "windows without an answer", state["backlog_windows"])
    yield _gauge("worker_processes", "processes that identify", state["workers"]["processes"])
    yield _gauge("windows_in_work", "windows in the workers", state["workers"]["windows_in_work"])
    yield _gauge("page_viewers", "pages kept up to date", state["viewers"])
    if state["database"]["bytes"] is not None:
        yield _gauge("database_size_bytes", "history on disk", state["database"]["bytes"])
    if state["disk"] is not None:
        yield _gauge("disk_free_bytes", "room where the state is kept", state["disk"]["free"])
    verdicts, durations = board.answers()
    windows = CounterMetricFamily(f"{P}windows", "windows answered since the start", labels=["verdict"])
    for verdict, count in sorted(verdicts.items()):
        windows.add_metric([verdict], count)
    yield windows
    total, buckets = 0, []
    for bound, count in zip([*map(str, BOUNDS), "+Inf"], durations.buckets, strict=True):
        total += count
        buckets.append((bound, total))
    times = HistogramMetricFamily(f"{P}identification_duration_seconds", "time to identify one window")
    times.add_metric([], buckets, durations.total)
    yield times
    moved = CounterMetricFamily(f"{P}alarm_transitions", "changes of alarms since the start", labels=["kind", "state"])
    for (kind, after), count in sorted(board.transitions().items()):
        moved.add_metric([kind, after], count)
    yield moved
    requests = CounterMetricFamily(f"{P}http_responses", "answers of the page since the start", labels=["code"])
    for code, count in sorted(answered.items()):
        requests.add_metric([code], count)
    yield requests


def _of_axes(axes: list[dict[str, Any]]) -> Iterator[Metric]:
    """One series per axis; those of friction where something was identified."""
    for name, text, field in (
        ("axis_samples", "samples received", "samples"),
        ("axis_missing_samples", "samples known to be missing", "missing"),
        ("axis_gaps", "breaks in which samples are missing", "gaps"),
        ("axis_rejected", "samples and payloads refused", "rejected"),
    ):
        counter = CounterMetricFamily(f"{P}{name}", text, labels=["axis"])
        for one in axes:
            counter.add_metric([one["axis"]], one[field])
        yield counter
    yield _per_axis("axis_last_sample_timestamp_seconds", "event time of the latest sample", axes, _last)
    yield _per_axis("axis_backlog_windows", "windows without an answer", axes, lambda one: one["pending"])
    yield _per_axis("axis_baseline_learned", "1 = its baseline is complete", axes, _learned)
    yield _per_axis("axis_alarm_threshold_ratio", "highest chart over its alarm threshold", axes, _height)
    yield _per_axis("axis_friction_change_ratio", "mid-speed friction over its baseline, less 1", axes, _change)
    for unit, word in FRICTION.items():
        yield _per_axis(f"axis_coulomb_friction_{word}", "latest Coulomb friction", axes, _friction(unit, None))
        for side, index in (("lower", 0), ("upper", 1)):
            text = f"{side} end of its 95 % interval"
            yield _per_axis(f"axis_coulomb_friction_{side}_{word}", text, axes, _friction(unit, index))
    alarms = GaugeMetricFamily(
        f"{P}alarm_standing", "1 = this alarm is not normal", labels=["axis", "kind", "state", "priority"]
    )
    for one in axes:
        for alarm in one["alarms"]:
            alarms.add_metric([one["axis"], alarm["kind"], alarm["state"], alarm["priority"] or "none"], 1)
    yield alarms


def _gauge(name: str, text: str, value: float) -> Metric:
    return GaugeMetricFamily(f"{P}{name}", text, value=float(value))


def _per_axis(name: str, text: str, axes: list[dict[str, Any]], value: Any) -> Metric:
    gauge = GaugeMetricFamily(f"{P}{name}", text, labels=["axis"])
    for one in axes:
        if (found := value(one)) is not None:
            gauge.add_metric([one["axis"]], float(found))
    return gauge


def _last(one: dict[str, Any]) -> float | None:
    return None if one["last_sample_ns"] is None else one["last_sample_ns"] / 1e9


def _learned(one: dict[str, Any]) -> int:
    return int(one["baseline"]["complete"])


def _height(one: dict[str, Any]) -> float | None:
    height: float | None = one["height"]
    return height


def _change(one: dict[str, Any]) -> float | None:
    change: float | None = one["change"]
    return change


def _friction(unit: str, side: int | None) -> Any:
    """Reads friction in `unit`, or an end of its interval."""

    def read(one: dict[str, Any]) -> float | None:
        friction = one["friction"]
        if friction is None or friction["unit"] != unit:
            return None
        if side is None:
            return float(friction["value"])
        return None if friction["ci95"] is None else float(friction["ci95"][side])

    return read
