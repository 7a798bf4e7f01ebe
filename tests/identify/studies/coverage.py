"""Do the 95 % intervals hold? Coverage over many simulated windows, refusals counted. `make coverage`."""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from identify.identification import identify_friction
from tests.identify.studies.machines import Case, Setting, draw_case

CASES = {
    "white noise, open loop, hold": Setting(dirt=0.0),
    "white noise, open loop, linear": Setting(dirt=0.0, linear=True),
    "white noise, sine": Setting("sine", dirt=0.0),
    "white noise, closed loop": Setting("loop", dirt=0.0),
    "coloured noise (50 ms)": Setting(dirt=0.0, coloured=0.05),
    "coloured noise (50 ms), dirt 0.5 %": Setting(coloured=0.05),
    "coloured noise, dirt 0.5 %, closed loop": Setting("loop", coloured=0.05),
    "dirt 0.5 %, hold": Setting(),
    "dirt 0.5 %, linear": Setting(linear=True),
    "dirt 0.5 %, sine": Setting("sine"),
    "dirt 0.5 %, closed loop": Setting("loop"),
    "dirt 2 %": Setting(dirt=0.02),
    "dirt 2 %, closed loop": Setting("loop", dirt=0.02),
    "slow dirt 1 % (2 s)": Setting(dirt=0.01, dirt_time=2.0),
    "friction level fluctuates by 2 %": Setting(dirt=0.02, dirt_on="level"),
    "dirt 0.5 %, mass unknown": Setting(mass_known=False),
    "dirt 0.5 %, mass unknown, closed loop": Setting("loop", mass_known=False),
    "noise 1 mm, dirt 0.5 %": Setting(noise=1e-3),
}
SPEEDS = np.array([0.05, 0.2, 0.5, 0.9])  # of the fastest
SHORT = {"coulomb_force": "Fc", "static_force": "Fs", "stribeck_velocity": "vs", "viscous_coefficient": "Fv",
         "constant_force": "F0", "moving_mass": "m"}  # fmt: skip


@dataclass(frozen=True)
class Window:
    """What one window gave: verdict, hit (1), miss (0) or no interval (nan) per parameter, hits of the band, errors."""

    verdict: str
    hits: dict[str, float]
    band: list[float]
    errors: dict[str, float]
    seconds: float


def judge_window(job: tuple[int, Setting]) -> Window:
    """Identify the window of one seed and compare with its truth."""
    seed, setting = job
    case: Case = draw_case(seed, setting)
    begin = time.perf_counter()
    result = identify_friction(case.recording, case.axis, seed=seed)
    seconds = time.perf_counter() - begin
    if not result.parameters:
        return Window(result.verdict.value, {}, [], {}, seconds)
    hits, errors = {}, {}
    for name, truth in case.truth.items():
        parameter = result.parameters[name]
        interval = parameter.ci95
        hits[name] = np.nan if interval is None else float(interval[0] <= truth <= interval[1])
        errors[name] = abs(parameter.value / truth - 1.0)
    speeds = result.curve.fastest * SPEEDS
    force, half = result.curve_at(speeds)
    band = (np.abs(force - case.law.force(speeds)) <= half).astype(float).tolist()
    return Window(result.verdict.value, hits, band, errors, seconds)


def study(setting: Setting, seeds: range, workers: int = 1) -> list[Window]:
    """All windows of one setting."""
    jobs = [(seed, setting) for seed in seeds]
    if workers == 1:
        return [judge_window(job) for job in jobs]
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(judge_window, jobs, chunksize=20))


def coverage(windows: list[Window], name: str) -> tuple[float, float, float, int]:
    """Share of intervals that hold the truth, its 95 % binomial (Clopper-Pearson) interval, windows without one."""
    hits = np.array([window.hits[name] for window in windows if window.hits])
    none = int(np.isnan(hits).sum())
    low, high = binomial(int(np.nansum(hits)), len(hits) - none)
    return float(np.nanmean(hits)), low, high, none


def binomial(successes: int, trials: int) -> tuple[float, float]:
    """95 % Clopper-Pearson interval of a rate."""
    low = 0.0 if successes == 0 else float(beta.ppf(0.025, successes, trials - successes + 1))
    high = 1.0 if successes == trials else float(beta.ppf(0.975, successes + 1, trials - successes))
    return low, high


def row(label: str, windows: list[Window]) -> str:
    """One line of the table."""
    cells = []
    for name in windows[0].hits:
        share, low, high, none = coverage(windows, name)
        cells.append(
            f"{SHORT[name]} {100 * share:.1f} ({100 * low:.1f}-{100 * high:.1f})" + (f" -{none}" if none else "")
        )
    band = np.array([window.band for window in windows if window.band])
    refused = sum(window.verdict != "identified" for window in windows)
    return f"| {label} | {' | '.join(cells)} | band {100 * band.mean():.1f} | {refused} |"


def main() -> None:
    """Print the table; `--windows N --first SEED --workers N --only WORD`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--windows", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first window; others are fresh ones")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for label, setting in CASES.items():
        if options.only in label:
            windows = study(setting, range(options.first, options.first + options.windows), options.workers)
            print(row(label, windows), f"{np.median([w.seconds for w in windows]):.3f} s", flush=True)


if __name__ == "__main__":
    main()
