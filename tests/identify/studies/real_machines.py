"""Estimates of real machines with intervals, run-to-run spread against them, or the reasoned refusal.

`make real-machines`; wants the recordings of `TRIBOWATCH_DATA`. Nothing in the method was tuned on them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from identify.identification import identify_friction
from identify.result import IdentificationResult
from plant.axis import Axis
from plant.axis_file import read_axis
from plant.recording import Recording
from plant.recording_files import read_recording_entry

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "docs" / "examples"
FOLDERS = {"emps": "emps", "rail-cart": "belt_cart_rail", "robot-joint": "openarm_dm_joints",
           "servo": "servo_presliding_lugre"}  # fmt: skip
JOINTS = {1: (0.02, 54.0), 2: (0.02, 54.0), 3: (0.02, 28.0), 4: (0.02, 28.0), 5: (0.01, 10.0), 6: (0.01, 10.0),
          7: (0.01, 10.0)}  # fmt: skip  # motor: J start [kg m^2], torque range [N m]
LONG = ("testOffPointOne", "testOffPointThree", "testOffPointFour", "testOffPointFive", "testOffPointSix")


def data_folder() -> Path:
    """Where the recordings are."""
    return Path(os.environ.get("TRIBOWATCH_DATA", ROOT.parent / "shared" / "data"))


def load(name: str, entry: int = 0, **select: str | float) -> tuple[Axis, Recording]:
    """Example axis `name` and one of its recordings, other rows of the same file where `select` says so."""
    axis = read_axis(EXAMPLES / f"{name}.toml")
    listed = axis.recordings[entry]
    file = data_folder() / FOLDERS[name] / listed.file.name
    return axis, read_recording_entry(replace(listed, file=file, select=select or listed.select), axis)


def joint(motor: int, repeat: int = 1) -> tuple[Axis, Recording]:
    """One joint of the arm."""
    axis, recording = load("robot-joint", motor=motor, repeat=repeat)
    inertia, reach = JOINTS[motor]
    mechanics = replace(axis.mechanics, J=inertia)
    drive = replace(axis.drive, rated_force=0.4 * reach, force_resolution=2 * reach / 4095)
    return replace(axis, name=f"joint-{motor}", mechanics=mechanics, drive=drive), recording


def recordings() -> Iterator[tuple[str, Axis, Recording]]:
    """Everything in the table."""
    yield "EMPS", *load("emps")
    yield "EMPS pulses", *load("emps", 1)
    for run in LONG:
        yield f"cart {run[12:]}", *load("rail-cart", run=run)
    for position in range(5, 73, 6):
        yield f"cart sweep {position} cm", *load("rail-cart", 1, run=f"0m{position:02d}")
    for motor in JOINTS:
        yield f"joint {motor}", *joint(motor)
    for motor in (1, 2):
        yield f"joint {motor} again", *joint(motor, 2)
    for run in range(1, 11):
        yield f"servo J {run}", *load("servo", test="J", run=run)
    yield "servo break-away", *load("servo", test="Fs", run=1)
    yield "servo pre-sliding", *load("servo", test="sigma0", run=1)


def line(label: str, axis: Axis, result: IdentificationResult) -> str:
    """One row of the table."""
    if result.curve is None:
        return f"| {label} | {result.verdict} | {result.reason} |"
    cells = []
    for parameter in result.parameters.values():
        interval = parameter.ci95
        known = "?" if interval is None else f"[{interval[0]:.4g}, {interval[1]:.4g}]"
        cells.append(f"{parameter.value:.4g} {known}")
    speeds = result.curve.fastest * np.array([0.25, 0.5, 0.9])
    force, half = result.curve_at(speeds)
    band = ", ".join(f"{v:.3g}: {f:.4g} ± {h:.2g}" for v, f, h in zip(speeds, force, half, strict=True))
    unit = f"{axis.force_unit} at {axis.position_unit}/s"
    shown = [label, str(result.verdict), *cells, f"{unit} {band}", str(result.observer), result.reason or ""]
    return f"| {' | '.join(shown)} |"


def main() -> None:
    """Print the table."""
    print("| recording | verdict | Fc | Fs | vs | Fv | F0 | mass | friction curve | observer | reason |")
    for label, axis, recording in recordings():
        result = identify_friction(recording, axis, seed=0)
        print(line(label, axis, result), "; ".join(result.preprocessing), flush=True)


if __name__ == "__main__":
    main()
