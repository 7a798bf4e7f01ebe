"""Which motion tells which parameter: Table 1 of the paper made quantitative. `make excitations`.

Horizontal machines, position noise of 1 mm (§4.6: variance 1e-6 m²), 0.5 % unrepeatable force, 20 s. A parameter counts
as told where the window calls it identifiable; how many of those intervals hold the truth stands beside it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

import numpy as np

from identify.identification import identify_friction
from plant.axis import Axis, Drive, Mechanics, Orientation
from plant.recording import Recording
from tests.identify.studies.machines import FRICTION, GAIN, RATED, coloured_noise, draw_plant
from tests.reference.excitation import Torque, multisine, saw, sine, square, staircase, stamps, two_squares
from tests.reference.machine import run
from tests.reference.parameters import ReferencePlant

Force = Callable[[np.ndarray, float, np.random.Generator], np.ndarray]  # t [s], static force [N], chance -> [N]
PERIOD, SAMPLES, NOISE, DIRT = 0.01, 2000, 1e-3, 0.005


def one_way(t: np.ndarray, static: float, _: np.random.Generator) -> np.ndarray:
    """Never turns back."""
    return static * (1.1 + 0.4 * np.sin(2 * np.pi * 0.3 * t) ** 2)


EXCITATIONS: dict[str, Force] = {
    "sine 0.1 Hz": lambda t, s, _: sine(t, 1.6 * s, 0.1),
    "sine 0.2 Hz": lambda t, s, _: sine(t, 1.8 * s, 0.2),
    "sine 0.5 Hz": lambda t, s, _: sine(t, 2.0 * s, 0.5),
    "three sines": lambda t, s, _: multisine(t, (1.2 * s, 0.7 * s, 0.5 * s), (0.13, 0.47, 1.1), (0.0, 1.0, 2.0)),
    "saw tooth 0.2 Hz": lambda t, s, _: saw(t, 1.8 * s, 0.2),
    "square 0.05 Hz": lambda t, s, _: square(t, 1.5 * s, 0.05),
    "square 0.2 Hz": lambda t, s, _: square(t, 1.5 * s, 0.2),
    "square 1 Hz": lambda t, s, _: square(t, 1.5 * s, 1.0),
    "two squares": lambda t, s, _: two_squares(t, (s, 0.6 * s), (0.1, 0.33)),
    "steps of random length": lambda t, s, rng: staircase(t, 1.8 * s, rng),
    "random": lambda t, s, rng: 2.0 * s * rng.standard_normal(len(t)),
    "one way": one_way,
    "below the static friction": lambda t, s, _: sine(t, 0.8 * s, 0.3),
}


def windows(force: Force, machines: int) -> Iterator[tuple[ReferencePlant, Axis, Recording]]:
    """Machines at random under one excitation."""
    for seed in range(machines):
        rng = np.random.default_rng(seed)
        drawn = draw_plant(rng, 3.0)
        plant = ReferencePlant(
            orientation="horizontal", M=drawn.M, J=drawn.J, force_per_torque=GAIN, effects=drawn.effects,
            **{name: getattr(drawn, name) for name in FRICTION},
        )  # fmt: skip
        t = stamps(SAMPLES * PERIOD, PERIOD)[:SAMPLES]
        dirt = DIRT * plant.coulomb_force * coloured_noise(SAMPLES, PERIOD, 0.1, rng)
        happened = run(plant, Torque(t, force(t, plant.static_force, rng) / GAIN), outer_force=dirt, step=5e-4)
        mechanics = Mechanics(Orientation.HORIZONTAL, plant.M, plant.J, plant.Rc, force_per_torque=GAIN)
        position = happened["position"] + NOISE * rng.standard_normal(SAMPLES)
        recording = Recording(t, happened["force_command"], position, sample_time=PERIOD)
        yield plant, Axis("excited", mechanics, Drive(RATED)), recording


def row(label: str, force: Force, machines: int) -> str:
    """One line of the table."""
    told, right, refused = np.zeros(4, dtype=int), np.zeros(4, dtype=int), 0
    widths = []
    for plant, axis, recording in windows(force, machines):
        result = identify_friction(recording, axis)
        refused += result.verdict != "identified"
        for index, name in enumerate(FRICTION):
            interval = result.parameters[name].ci95 if result.parameters else None
            if interval is not None:
                told[index] += 1
                right[index] += interval[0] <= getattr(plant, name) <= interval[1]
        if result.curve is not None:
            value, half = result.curve_at([0.3 * result.curve.fastest, 0.9 * result.curve.fastest])
            widths.append(half / value)
    cells = " | ".join(f"{a} ({b})" for a, b in zip(told, right, strict=True))
    width = " / ".join(f"{100 * w:.2g}" for w in np.median(widths, axis=0)) if widths else ""
    return f"| {label} | {cells} | {width} | {refused} |"


def main() -> None:
    """Print the table; `--machines N`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=20)
    options = parser.parse_args()
    print("| motion | Fc told (right) | Fs | vs | Fv | half-width of F(v) % at 0.3 / 0.9 of the speed | refused |")
    for label, force in EXCITATIONS.items():
        print(row(label, force, options.machines), flush=True)


if __name__ == "__main__":
    main()
