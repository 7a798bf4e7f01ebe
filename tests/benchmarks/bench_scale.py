"""`make bench-scale`: what 1, 10, 100 and 1000 axes at 100 Hz cost one daemon, and how long answers and alerts take.

`python -m tests.benchmarks.bench_scale [--axes 1,10,100,1000] [--seconds 100] [--json FILE]`
"""

import argparse
import collections
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.benchmarks.scale_corridor import cost
from tests.benchmarks.scale_streams import Generator
from tests.scenarios.harness import SITE, Plant, wait_for

SETTINGS = """
[window]
samples = 1000
hop = {hop}
[drift]
baseline_windows = {learns}
baseline_span = 0.0
[alarms]  # of eight windows, one every five seconds, no change is sure in a minute at one false alarm a year
false_alarms_per_axis_year = 10000.0
[log]
format = "json"
"""
TICK = os.sysconf("SC_CLK_TCK")
WARM_UP = 15.0  # s, after which costs are counted


def cpu_seconds(pid: int) -> float:
    """User and system time of one process. [s]"""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / TICK


def memory(pid: int) -> float:
    """Resident memory. [MB]"""
    line = next(line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


class Listener:
    """When parameters and alerts came, against the stamp of the last sample they rest on."""

    def __init__(self, session) -> None:
        self.parameters, self.alerts, self.status = [], [], {}
        self.verdicts: collections.Counter[str] = collections.Counter()
        for what, hear in (("parameters", self._answer), ("alerts", self._alert), ("status", self._status)):
            session.declare_subscriber(f"tribowatch/{SITE}/*/{what}", hear)

    def _answer(self, sample) -> None:
        content = json.loads(sample.payload.to_bytes())
        self.verdicts[content["verdict"]] += 1
        self.parameters.append((time.time_ns() - content["window"]["end_ns"]) / 1e9)

    def _alert(self, sample) -> None:
        content = json.loads(sample.payload.to_bytes())
        if content["kind"] in ("wear", "lubrication", "jam") and content["transition"]["before"] == "normal":
            self.alerts.append((time.time_ns() - content["transition"]["at_ns"]) / 1e9)

    def _status(self, sample) -> None:
        content = json.loads(sample.payload.to_bytes())
        self.status[content["axis"]] = content


def measure(count: int, seconds: float, folder: Path, hop: int = 500, learns: int = 8) -> dict:
    """Run `count` axes for `seconds`, with windows every `hop` samples and a baseline of `learns` of them."""
    names = [f"axis-{k:04d}" for k in range(count)]
    with Plant(folder, axes=names, settings=SETTINGS.format(hop=hop, learns=learns)) as plant:
        plant.start(300.0)
        with plant.session() as session:
            ears = Listener(session)
            worn = max(1, count // 10)
            generator = Generator(session, SITE, names, 0.6 * seconds, worn)
            generator.start()
            wait_for(lambda: len(ears.status) == count, 60, "status of every axis")
            time.sleep(WARM_UP)
            pid = plant.process.pid
            before, begun, answered = cpu_seconds(pid), time.monotonic(), len(ears.parameters)
            lags = []
            while time.monotonic() - begun < seconds - WARM_UP:
                time.sleep(1.0)
                lags += [one["lag"]["intake_seconds"] for one in list(ears.status.values())]
            passed = time.monotonic() - begun
            cpu, rss = cpu_seconds(pid) - before, memory(pid)
            statuses = list(ears.status.values())
            generator.stop.set()
            generator.join()
            parameters, alerts = ears.parameters[answered:], list(ears.alerts)
        plant.terminate()
        log = plant.log
    return {
        "axes": count,
        "seconds": round(passed, 1),
        "samples_per_second": 100 * count,
        "daemon_cpu_share": round(cpu / passed, 4),
        "daemon_cpu_ms_per_axis_second": round(1e3 * cpu / passed / count, 3),
        "windows_per_second": round(len(parameters) / passed, 2),
        "daemon_memory_mb": round(rss, 1),
        "intake_delay_p50_ms": round(1e3 * float(np.quantile(lags, 0.5)), 1),
        "intake_delay_p99_ms": round(1e3 * float(np.quantile(lags, 0.99)), 1),
        "missing": sum(one["missing"] for one in statuses),
        "rejected": sum(sum(one["rejected"].values()) for one in statuses),
        "windows": len(parameters),
        "verdicts": dict(ears.verdicts),
        "hop_stretched": sorted({one["hop"]["stretched"] for one in statuses}),
        "oldest_window_seconds": round(max(one["lag"]["windows_seconds"] for one in statuses), 1),
        "to_parameters_s": quantiles(parameters),
        "worn_axes": worn,
        "alerts": len(alerts),
        "to_alert_s": quantiles(alerts),
        "generator_late_s": round(generator.late, 3),
        "stretches_logged": log.count("the hop is stretched"),
    }


def quantiles(values) -> list[float] | None:
    """p50 and p99, or None."""
    return [round(float(q), 3) for q in np.quantile(values, (0.5, 0.99))] if values else None


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--axes", default="1,10,100,1000")
    options.add_argument("--seconds", type=float, default=160.0)
    options.add_argument("--long", type=float, default=420.0, help="seconds for 1000 axes and more")
    options.add_argument("--hop", type=int, default=500, help="samples from one window to the next")
    options.add_argument("--long-hop", type=int, default=500, help="the same for 1000 axes and more")
    options.add_argument("--learns", type=int, default=8, help="windows of a baseline")
    chosen = options.parse_args()
    rows = []
    for count in map(int, chosen.axes.split(",")):
        seconds, hop = (chosen.long, chosen.long_hop) if count >= 1000 else (chosen.seconds, chosen.hop)
        with tempfile.TemporaryDirectory() as folder:
            corridor = cost(Path(folder), count, max(10, 3000 // count))
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(count, seconds, Path(folder), hop, chosen.learns))
        rows[-1]["corridor_cpu_ms_per_axis_second"] = round(1e3 * corridor, 3)
        sys.stdout.write(json.dumps(rows[-1]) + "\n")
        sys.stdout.flush()
    if len(rows) > 1:
        one, most = rows[0], rows[-1]
        per_axis = (most["daemon_memory_mb"] - one["daemon_memory_mb"]) / (most["axes"] - one["axes"])
        sys.stdout.write(json.dumps({"memory_mb_per_axis": round(per_axis, 3)}) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
