"""The watch on recordings of real robot joints in which nothing was broken: no wear alarm. `make robot-joints`.

Each run is cut into windows of eight seconds that do not overlap; a second run of a joint follows the first. With
five windows the baseline is as short as the settings allow; event time is the recordings' own.
"""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np

from monitor.axis_run import drift_rule
from monitor.config import Config
from monitor.drift import DriftState, judge
from monitor.identify_window import Job, identify_window
from monitor.samples import Samples, Window, WindowId
from plant.axis_file import read_axis
from plant.recording_files import read_recording

DATA = Path(os.environ.get("TRIBOWATCH_DATA", "../shared/data")) / "openarm_dm_joints"
EXAMPLE = Path("docs/examples/robot-joint.toml")
SAMPLES = 400
BASELINE = 5
RESOLUTION = {1: 0.02637, 2: 0.02637, 3: 0.01368, 4: 0.01368, 5: 0.00488, 6: 0.00488, 7: 0.00488}  # N m


def windows(motor: int, folder: Path):
    """(axis, samples) of every window of a joint, its runs one after the other."""
    number, begin_ns = 0, 0
    for repeat in (1, 2):
        text = EXAMPLE.read_text().replace("motor = 1, repeat = 1", f"motor = {motor}, repeat = {repeat}")
        text = text.replace("torque_resolution = 0.02637", f"torque_resolution = {RESOLUTION[motor]}")
        path = folder / f"joint-{motor}-{repeat}.toml"
        path.write_text(text.replace('file = "', f'file = "{DATA}/'))
        axis = read_axis(path)
        try:
            recording = read_recording(axis.recordings[0].file, axis)
        except Exception as error:  # no second run of this joint
            if repeat == 1:
                raise
            print(f"  joint {motor}: one run ({type(error).__name__})")
            return
        for first in range(0, len(recording) - SAMPLES + 1, SAMPLES):
            part = slice(first, first + SAMPLES)
            stamps = begin_ns + np.round(1e9 * (recording.t[part] - recording.t[0])).astype(np.int64)
            yield axis, Samples(1, number * SAMPLES, stamps, recording.force[part], recording.position[part])
            number += 1
        begin_ns += 3600 * 10**9


def main(folder: Path) -> None:
    alarms, total, informative = [], 0, 0
    for motor in range(1, 8):
        state, said = DriftState(), []
        for axis, samples in windows(motor, folder):
            window = Window(WindowId(1, samples.seq, SAMPLES), int(samples.t_ns[0]), int(samples.t_ns[-1]))
            job = Job(0, dataclasses.replace(axis, recordings=()), window, samples, 0, "ga+polish")
            rule = dataclasses.replace(drift_rule(axis, Config(site="study")), baseline_windows=BASELINE)
            answer = identify_window(job)
            total, informative = total + 1, informative + answer.informative
            state, findings = judge(state, answer, rule)
            said += [finding.kind.value for finding in findings if finding.holds]
        learned = state.baseline.windows if state.baseline else f"{len(state.learned)} so far"
        print(
            f"joint {motor}: baseline {learned}, watched {len(state.recent)}, said {sorted(set(said)) or 'nothing'}",
            flush=True,
        )
        alarms += said
    print(f"{total} windows, {informative} informative; wear alarms: {alarms.count('wear')}")


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as where:
        main(Path(where))
