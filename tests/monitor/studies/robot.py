"""The watch on recordings of real machines in which nothing was broken: no wear alarm. `make robot-joints`.

*Robot joints*: runs cut into windows that do not overlap, at several lengths; a second run of a joint follows the
first.
*Cart on a rail*: 68 runs of 20 s at 68 places along the rail, each one window; once in the order of the places, so that
the axis moves away from where its baseline was learned, and once every second place first, so that the baseline knows
the whole rail. Event time is made up (a window an hour), so the baseline needs no span.
"""

from __future__ import annotations

import collections
import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from monitor.axis_run import drift_rule
from monitor.config import Config
from monitor.drift import DriftState, judge
from monitor.estimate import Estimate
from monitor.identify_window import Job, identify_window
from monitor.samples import Samples, Window, WindowId
from plant.axis import Axis
from plant.axis_file import read_axis
from plant.recording import Recording
from plant.recording_files import read_recording

DATA = Path(os.environ.get("TRIBOWATCH_DATA", "../shared/data")).absolute()
LENGTHS = (400, 800, 1350)  # samples of a window: 8, 16 and 28 s, the last as long as the sweep of all speeds
SHORTEST = 5  # windows of a baseline, the least the settings allow
RESOLUTION = {1: 0.02637, 2: 0.02637, 3: 0.01368, 4: 0.01368, 5: 0.00488, 6: 0.00488, 7: 0.00488}  # N m
CART_SAMPLES = 2900  # of a run, before its current is switched off
HOUR_NS = 3600 * 10**9


def windows(recording: Recording, samples: int, first: int = 0, gain: float = 1.0) -> Iterator[Samples]:
    """Windows of a recording, from number `first` on, an hour apart."""
    for number, begin in enumerate(range(0, len(recording) - samples + 1, samples), start=first):
        part = slice(begin, begin + samples)
        stamps = number * HOUR_NS + np.round(1e9 * (recording.t[part] - recording.t[begin])).astype(np.int64)
        yield Samples(1, number * samples, stamps, recording.force[part] / gain, recording.position[part])


def answer(axis: Axis, samples: Samples) -> Estimate:
    window = Window(WindowId(1, samples.seq, len(samples)), int(samples.t_ns[0]), int(samples.t_ns[-1]))
    return identify_window(Job(0, dataclasses.replace(axis, recordings=()), window, samples, 0, "ga+polish"))


def watched(axis: Axis, answers: list[Estimate], baseline: int) -> tuple[DriftState, collections.Counter[str]]:
    """State after all windows, and how many windows said what."""
    rule = dataclasses.replace(drift_rule(axis, Config(site="study")), baseline_windows=baseline, baseline_span=0.0)
    state, said = DriftState(), collections.Counter()
    for one in answers:
        state, findings = judge(state, one, rule)
        said.update(finding.kind.value for finding in findings if finding.holds)
    return state, said


def joint(motor: int, folder: Path) -> tuple[Axis, list[Recording]]:
    """A joint and its runs."""
    found: list[Recording] = []
    for repeat in (1, 2) if motor <= 2 else (1,):
        text = Path("docs/examples/robot-joint.toml").read_text()
        text = text.replace("motor = 1, repeat = 1", f"motor = {motor}, repeat = {repeat}")
        text = text.replace("torque_resolution = 0.02637", f"torque_resolution = {RESOLUTION[motor]}")
        path = folder / f"joint-{motor}-{repeat}.toml"
        path.write_text(text.replace('file = "', f'file = "{DATA}/openarm_dm_joints/'))
        axis = read_axis(path)
        found.append(read_recording(axis.recordings[0].file, axis))
    return axis, found


def joints(folder: Path) -> None:
    for samples in LENGTHS:
        total, informative, alarms, learned, most = 0, 0, collections.Counter(), 0, 0
        for motor in range(1, 8):
            axis, runs = joint(motor, folder)
            answers: list[Estimate] = []
            for run in runs:
                answers += [answer(axis, one) for one in windows(run, samples, len(answers))]
            state, said = watched(axis, answers, SHORTEST)
            good = sum(one.informative for one in answers)
            total, informative, most = total + len(answers), informative + good, max(most, good)
            learned += state.baseline is not None
            alarms += said
        print(
            f"robot joints, windows of {samples} samples: {total}, {informative} informative, at most {most} of one "
            f"joint, where a baseline wants {SHORTEST}; {learned} of 7 baselines; said {dict(alarms) or 'nothing'}",
            flush=True,
        )


def cart(folder: Path) -> None:
    text = Path("docs/examples/rail-cart.toml").read_text()
    runs = []
    for centimetre in range(5, 73):
        path = folder / f"cart-{centimetre}.toml"
        here = text.replace('run = "0m20"', f'run = "0m{centimetre:02d}"')
        path.write_text(here.replace('file = "', f'file = "{DATA}/belt_cart_rail/'))
        axis = read_axis(path)
        recording = read_recording(axis.recordings[1].file, dataclasses.replace(axis, recordings=axis.recordings[1:]))
        one = next(windows(recording, min(CART_SAMPLES, len(recording)), 0, axis.mechanics.gain))
        runs.append(one)
    once = [answer(axis, one) for one in runs]
    orders = {
        "in the order of the places": list(range(len(runs))),
        "every second place first": [*range(0, len(runs), 2), *range(1, len(runs), 2)],
    }
    for words, order in orders.items():
        answers = []
        for number, k in enumerate(order):
            window = once[k].window
            ident = dataclasses.replace(window.id, first_seq=10_000 * number)
            start = number * HOUR_NS
            shifted = dataclasses.replace(window, id=ident, start_ns=start, end_ns=start + 20 * 10**9)
            answers.append(dataclasses.replace(once[k], window=shifted))
        state, said = watched(axis, answers, 20)
        level = [abs(one.curve.at((0.1,))[0][0]) for one in answers if one.curve and one.curve.at((0.1,))]
        spread = f"friction at 0.1 m/s {np.mean(level):.2f} N, scatter {np.std(level) / np.mean(level):.1%}"
        print(
            f"cart on a rail, {words}: {len(answers)} windows, {sum(one.informative for one in answers)} informative, "
            f"baseline of {state.baseline.windows if state.baseline else 0}, watched {len(state.trend)}; {spread}; "
            f"windows that said {dict(said) or 'nothing'}",
            flush=True,
        )


def main(folder: Path) -> None:
    cart(folder)
    joints(folder)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as where:
        main(Path(where))
