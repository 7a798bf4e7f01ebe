"""How often does a healthy axis cry wolf? Axis-years at the level of estimates, at three settings. `make axis-years`.

Every axis has its own kind, cadence, scatter, wandering friction, temperatures and payload; what identification adds
comes from the pool of real answers. An alarm is a finding of any kind after a window without one; the year begins with
the first window after the baseline.
"""

from __future__ import annotations

import argparse
import collections
import time

from scipy.stats import chi2

from monitor.drift import DriftRule, DriftState, judge
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import Axis, Pool, estimates

WEIGHT = 196.2  # N, of the paper's axis
SETTINGS = (1.0, 0.3, 3.0)
BASELINE = 20


def year(axis: Axis, pool: Pool, rates: tuple[float, ...]) -> list[collections.Counter[str]]:
    """Alarms by kind in one healthy year, per setting."""
    weight = 0.0 if FAMILIES[axis.family].horizontal else WEIGHT
    rules = [DriftRule(false_alarms_per_year=rate, weight=weight) for rate in rates]
    states, before = [DriftState()] * len(rules), [False] * len(rules)
    counts = [collections.Counter() for _ in rules]
    for one in estimates(axis, pool, BASELINE + round(365.25 * 24 / axis.every_hours)):
        for i, rule in enumerate(rules):
            states[i], findings = judge(states[i], one, rule)
            held = [finding.kind.value for finding in findings if finding.holds]
            if held and not before[i]:
                counts[i][held[0]] += 1
            before[i] = bool(held)
    return counts


def interval(count: int, years: float) -> tuple[float, float]:
    """95 % Poisson interval of the rate. [1/a]"""
    low = chi2.ppf(0.025, 2 * count) / 2 if count else 0.0
    return low / years, chi2.ppf(0.975, 2 * (count + 1)) / 2 / years


def main(years: int, rates: tuple[float, ...], first: int = 0) -> None:
    pool, begin = Pool(), time.monotonic()
    sums = [collections.Counter() for _ in rates]
    axes = [collections.Counter() for _ in rates]
    for seed in range(first, first + years):
        for i, found in enumerate(year(Axis.at_random(seed), pool, rates)):
            sums[i] += found
            axes[i][sum(found.values())] += 1
        done = seed - first + 1
        if done % 50 == 0 or done == years:
            print(f"{done} axis-years, {len(pool)} real answers, {time.monotonic() - begin:.0f} s", flush=True)
            for rate, counted, each in zip(rates, sums, axes, strict=True):
                total = sum(counted.values())
                low, high = interval(total, done)
                told = f"{total / done:.3f} [{low:.3f}, {high:.3f}]"
                print(f"  setting {rate:g}/a: {told} {dict(counted)} worst axis {max(each)}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--years", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rates", type=float, nargs="+", default=list(SETTINGS))
    given = parser.parse_args()
    main(given.years, tuple(given.rates), given.first)
