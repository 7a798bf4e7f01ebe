"""Does the experiment that a diagnosis proposes settle what it left open? `make next-experiment`.

Cases whose names are hard to tell apart are drawn by the independent simulator and diagnosed; where more than one set
is left and an experiment is proposed, the *true* machine runs it in the simulator, and the diagnosis is repeated with
its recording along. Counted: how often the tie is resolved to the truth, stays, or is resolved wrongly; and the same
with the running motion recorded once more instead, for that alone also adds evidence. Training seeds.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import replace

import numpy as np

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.experiment import NEEDED, settling
from identify.mismatch.result import Diagnosis
from identify.mismatch.separation import Motion as Wanted
from plant.axis import Axis
from plant.recording import Recording
from tests.blind.tables import rate
from tests.identify.studies.reading import recorded
from tests.reference.cases import Case, CaseSpec, UndrawableError, draw_case
from tests.reference.control import PD, Loop
from tests.reference.excitation import Motion, Torque, with_derivatives
from tests.reference.foreign import wandering
from tests.reference.machine import run
from tests.reference.recording import Sensors, record

OMEGA = 2.0 * np.pi * 3.0  # rad/s of the loop that runs a proposed motion; not the one it was simulated with
KINDS = (
    ("actuator_lag", "sine"), ("dead_time", "sine"), ("actuator_lag", "loop_sine"), ("coulomb_asymmetry", "sine"),
    ("load_dependent_friction", "sine"), ("dead_time", "loop_sine"), ("inertia_error", "sine"),
    ("actuator_lag", "two_squares"), ("torque_scale_error", "sine"), ("dead_time", "loop_trapezoid"),
)  # fmt: skip


def perform(case: Case, wanted: Wanted, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Let the true machine of `case` run the motion and record it as its other runs were."""
    plant, spec = case.plant, case.spec
    if wanted.payload:
        plant = replace(plant, **({"J": plant.J + wanted.payload} if plant.M == 0 else {"M": plant.M + wanted.payload}))
    excitation: Torque | Motion
    if wanted.closed:
        t = np.arange(0.0, wanted.seconds - 2e-3, 1e-3)
        position = np.interp(t, wanted.step * np.arange(len(wanted.wanted)), wanted.wanted)
        mass = plant.moving_mass
        loop = Loop(PD, mass * OMEGA**2, 2.0 * mass * OMEGA, bias=plant.weight, limit=50.0 * plant.unit_force,
                    mass=mass, period=1e-3)  # fmt: skip
        start = float(position[0])
        excitation = Motion(t, *with_derivatives(position, 1e-3), loop)
    else:
        t = wanted.step * np.arange(len(wanted.wanted))
        start = float(case.recordings[0]["columns"]["position"][0])
        excitation = Torque(t, wanted.wanted / plant.gain)
    dirt = wandering(t, spec.dirt * plant.coulomb_force, 0.1, rng)
    truth = run(plant, excitation, outer_force=dirt, position0=start, settled=True)
    force = "mean" if wanted.closed and spec.period > 1e-3 else "held"
    return record(truth, Sensors(period=spec.period, position_noise=spec.noise, force=force), rng)


def with_recording(axis: Axis, before: list[Recording], columns: dict[str, np.ndarray]) -> list[Recording]:
    """The recordings that exist and the new one, the last of the old ones still last: it is held out."""
    new = replace(before[0], t=columns["t"], force=columns["force"], position=columns["position"], velocity=None,
                  note="experiment", source="experiment")  # fmt: skip
    return [*before[:-1], new, before[-1]]


def outcome(found: Diagnosis, truth: tuple[str, ...]) -> str:
    """What a second diagnosis made of the tie."""
    sets = [set(names) for names in found.alternatives]
    if not sets:
        return found.verdict.value
    if set(truth) in sets:
        return "resolved" if len(sets) == 1 else "tied"
    return "wrong"


def cases(count: int, seed: int) -> list[tuple[str, Case]]:
    """Hard cases, each kind in turn."""
    drawn = []
    for number in range(count):
        effect, excitation = KINDS[number % len(KINDS)]
        rng = np.random.default_rng([77, seed, number])
        for attempt in range(10):
            spec = CaseSpec(seed + 10 * number + attempt, (effect,), excitation=excitation, duration=20.0,
                            size=float(rng.uniform(0.5, 1.2)), noise=float(rng.choice([1e-5, 1e-4])),
                            orientation=str(rng.choice(["vertical", "horizontal"])))  # fmt: skip
            try:
                drawn.append((effect, draw_case(spec)))
                break
            except UndrawableError:
                continue
    return drawn


def main() -> None:
    """Print every case, then the rates."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=32)
    parser.add_argument("--seed", type=int, default=71_000, help="a training seed")
    parser.add_argument("--no-control", action="store_true", help="leave out the running motion recorded once more")
    given = parser.parse_args()
    ends: dict[str, Counter[str]] = {"proposed": Counter(), "repeated": Counter()}
    for effect, case in cases(given.cases, given.seed):
        axis, recordings = recorded(case)
        clock = time.perf_counter()
        first = diagnose(recordings, axis)
        seconds = time.perf_counter() - clock
        best = settling(first.experiments)
        label = f"{effect:<26}{case.spec.excitation:<11}{case.spec.orientation:<11}"
        if best is None:
            print(
                f"{label}{first.verdict.value}: {[e.name for e in first.effects]}, no tie ({seconds:.1f} s)", flush=True
            )
            continue
        told = "; ".join("/".join(f"{value:.0f}" for _, value in one.told) for one in first.experiments)
        if (effect,) not in [tuple(names) for names in first.alternatives]:
            print(f"{label}{first.alternatives}: the truth is not among the tied", flush=True)
            ends["proposed"]["truth not among the tied"] += 1
            continue
        print(
            f"{label}{first.alternatives} ({seconds:.1f} s)\n    {first.next_experiment}\n    all: {told}", flush=True
        )
        ways = [("proposed", best), ("repeated", first.experiments[0])][: 1 if given.no_control else 2]
        for way, experiment in ways:
            if way == "proposed" and best.motion.payload:
                ends[way]["payload, not repeated"] += 1
                continue
            columns = perform(case, experiment.motion, np.random.default_rng([78, case.spec.seed]))
            again = diagnose(with_recording(axis, recordings, columns), axis)
            end = outcome(again, (effect,))
            enough = " sufficient" if best.separation >= NEEDED else " partly" if best.settled else " insufficient"
            sure = "" if way == "repeated" else enough
            ends[way][end + sure] += 1
            print(f"    {way}: {end} {again.alternatives}", flush=True)
    for way, count in ends.items():
        print(way, dict(count))
    sure = {end: n for end, n in ends["proposed"].items() if end.endswith(" sufficient")}
    resolved = sure.get("resolved sufficient", 0)
    print(
        rate(
            "proposed as sufficient: tie resolved to the truth",
            [True] * resolved + [False] * (sum(sure.values()) - resolved),
        )
    )


if __name__ == "__main__":
    main()
