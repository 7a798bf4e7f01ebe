"""Does the search find the right basin from nothing, and how well does it end? `make blind-starts`.

Right basin: every force of the friction curve within the visited speeds is right to a tenth, and starting the same
problem at the truth ends in no likelier place.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

import numpy as np

from identify.identification import identify_friction
from tests.identify.studies.machines import FRICTION, Setting, draw_case

EXCITATIONS = ("sine", "multi", "loop")
NOISES = (1e-5, 1e-4, 1e-3)
DIRTS = (0.0, 0.005, 0.01, 0.02)
SPEEDS = np.array([0.1, 0.3, 0.6, 0.95])  # of the fastest
MEDIAN = 0.5 * 0.6745 / 1.96  # of the width of a 95 % interval: the median error it promises
RIGHT = 0.1  # of the friction


@dataclass(frozen=True)
class Start:
    """One blind start: whether it ended right, its relative errors (4,), those its intervals promise, the verdict."""

    right: bool
    errors: list[float]
    promised: list[float]
    verdict: str
    worst_curve: float


def blind_start(seed: int, setting: Setting) -> Start:
    """Identify the recording of one seed from nothing."""
    case = draw_case(seed, setting)
    result = identify_friction(case.recording, case.axis, seed=seed)
    speeds = result.curve.fastest * SPEEDS
    force, half = result.curve_at(speeds)
    truth = case.law.force(speeds)
    off = np.abs(force - truth)
    errors = [abs(result.parameters[name].value / case.truth[name] - 1.0) for name in FRICTION]
    intervals = [result.parameters[name].ci95 for name in FRICTION]
    promised = [
        np.nan if ends is None else MEDIAN * (ends[1] - ends[0]) / case.truth[name]
        for name, ends in zip(FRICTION, intervals, strict=True)
    ]
    return Start(
        bool(np.all(off <= np.maximum(RIGHT * truth, half))),
        errors,
        promised,
        result.verdict.value,
        float((off / truth).max()),
    )


def cell(
    excitation: str, noise: float, plants: int, samples: int = 3000, dirts: tuple[float, ...] = DIRTS
) -> list[Start]:
    """`plants` machines of one excitation and noise, their dirt going round `dirts`."""
    setting = Setting(excitation, noise=noise, samples=samples)
    return [blind_start(9000 + seed, replace(setting, dirt=dirts[seed % len(dirts)])) for seed in range(plants)]


def row(excitation: str, noise: float, starts: list[Start]) -> str:
    """One line of the table."""
    errors = 100 * np.median([start.errors for start in starts], axis=0)
    right = sum(start.right for start in starts)
    refused = sum(start.verdict != "identified" for start in starts)
    cells = " / ".join(f"{error:.2f}" for error in errors)
    promised = 100 * np.nanmedian([start.promised for start in starts], axis=0)
    cells += " | " + " / ".join(f"{error:.2f}" for error in promised)
    worst = 100 * max(start.worst_curve for start in starts)
    return f"| {excitation} | {noise:g} | {right}/{len(starts)} | {cells} | {worst:.1f} | {refused} |"


def main() -> None:
    """Print the table; `--plants N`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=24)
    parser.add_argument("--dirt", type=float, nargs="*", default=DIRTS, help="shares of F_c, taken in turn")
    options = parser.parse_args()
    print(
        "| excitation | noise m | right basin | median error % Fc/Fs/vs/Fv | promised by the intervals |"
        " worst curve % | refused |"
    )
    for excitation in EXCITATIONS:
        for noise in NOISES:
            print(
                row(excitation, noise, cell(excitation, noise, options.plants, dirts=tuple(options.dirt))), flush=True
            )


if __name__ == "__main__":
    main()
