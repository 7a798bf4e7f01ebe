"""A scenario through identification and watch, burst by burst, without daemon or stream.

`make watch-scenarios ARGS="jam bad_sensor"` prints when which finding holds; without names, of all scenarios.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator

import numpy as np

from monitor.alerts import explain
from monitor.axis_run import drift_rule
from monitor.config import Config
from monitor.drift import DriftState, Finding, judge
from monitor.estimate import Estimate
from monitor.identify_window import Job, identify_window
from monitor.samples import Samples, Window, WindowId
from plant.axis import Axis
from plant.recording import Recording
from plant.scenario import Scenario
from plant.scenario_file import names, read_scenario


def samples_of(recording: Recording, axis: Axis, begin_ns: int, seq: int) -> Samples:
    """A recording as the stream brings it."""
    stamps = begin_ns + np.round(1e9 * (recording.t - recording.t[0])).astype(np.int64)
    return Samples(1, seq, stamps, recording.force / axis.mechanics.gain, recording.position,
                   temperature=recording.temperature, load=recording.load)  # fmt: skip


def estimate_of(
    recording: Recording, axis: Axis, begin_ns: int, number: int, effects: tuple[str, ...] = ()
) -> Estimate:
    """Burst `number`, identified."""
    samples = samples_of(recording, axis, begin_ns, 2000 * number)
    window = Window(WindowId(1, 2000 * number, len(samples)), int(samples.t_ns[0]), int(samples.t_ns[-1]))
    return identify_window(Job(number, axis, window, samples, number, "ga+polish", effects=effects))


def estimates(scenario: Scenario, numbers: Iterator[int] | None = None) -> Iterator[Estimate]:
    """All bursts that make a whole window."""
    axis = dataclasses.replace(scenario.axis, recordings=())
    for number in numbers or range(len(scenario)):
        burst = scenario.burst(number)
        if len(burst.recording) == scenario.bursts.samples:  # else gaps: no window
            yield estimate_of(burst.recording, axis, burst.begin_ns, number)


def watch(scenario: Scenario, found: Iterator[Estimate]) -> Iterator[tuple[Estimate, DriftState, list[Finding]]]:
    """What the watch says after each window."""
    state, rule = DriftState(), drift_rule(scenario.axis, Config(site="study"))
    for one in found:
        state, findings = judge(state, one, rule)
        yield one, state, findings


def main(chosen: list[str]) -> None:
    for name in chosen or names():
        scenario = read_scenario(name)
        begin, before = scenario.begin_ns(0), set()
        print(f"=== {name}: {scenario.description}")
        for one, _, findings in watch(scenario, estimates(scenario)):
            held = {finding.kind.value for finding in findings if finding.holds}
            day = (one.window.start_ns - begin) / 86400e9
            if held != before:
                text = [explain(name, f.kind, f.evidence) for f in findings if f.holds]
                print(f"day {day:6.1f}: {sorted(held)} {one.verdict} {' | '.join(text)}", flush=True)
            before = held


if __name__ == "__main__":
    main(sys.argv[1:])
