"""Error of output error over runs of a given length, against the observer. `make run-length`.

Output error restarts at a free state every L seconds (multiple shooting). It starts at the truth, so what is shown is
where its optimum lies, not whether a search finds it; the observer starts from nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from identify.criterion import FREE, restarted
from identify.identification import identify_friction
from identify.polish import polish
from identify.preprocess import prepare
from identify.problem import FINEST_SUBSTEP, FrictionProblem
from tests.identify.studies.machines import FRICTION, Case, Setting, draw_case

LENGTHS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)  # s
SETTINGS = {
    "multi-sine, open loop": Setting("multi", samples=6000),
    "trapezoids with dwells, closed loop": Setting("loop", samples=6000),
}


def output_error(case: Case, run_length: float) -> list[float]:
    """Relative errors of the four friction parameters by output error over runs of `run_length` [s]."""
    whole = FrictionProblem(prepare(case.recording, case.axis), case.axis)
    samples, states = restarted(whole.samples, run_length)
    problem = FrictionProblem(
        samples, case.axis, scales=whole.scales, first_state=states, longest_substep=2 * FINEST_SUBSTEP
    )
    begin = np.concatenate([whole.encode(case.truth)[: whole.p], np.zeros(2 * samples.runs)])
    end = polish(problem, begin, FREE, 25).x
    return [abs(value / case.truth[name] - 1.0) for name, _, value, *_ in problem.named(end)[:4]]


def observer(case: Case, seed: int) -> list[float]:
    """The same by the default method."""
    result = identify_friction(case.recording, case.axis, seed=seed)
    return [abs(result.parameters[name].value / case.truth[name] - 1.0) for name in FRICTION]


def medians(errors: Sequence[list[float]]) -> str:
    """Medians in percent, Fc / Fs / vs / Fv."""
    return " / ".join(f"{value:.2g}" for value in 100 * np.median(errors, axis=0))


def main() -> None:
    """Print the table; `--machines N`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machines", type=int, default=10)
    options = parser.parse_args()
    for label, setting in SETTINGS.items():
        cases = [draw_case(700 + seed, setting) for seed in range(options.machines)]
        for length in LENGTHS:
            print(f"| {label} | {length:g} s | {medians([output_error(case, length) for case in cases])} |", flush=True)
        found = [observer(case, seed) for seed, case in enumerate(cases)]
        print(f"| {label} | observer | {medians(found)} |", flush=True)


if __name__ == "__main__":
    main()
