"""How often does a healthy axis cry wolf? Axis-years at the level of estimates, at three settings. `make axis-years`.

Every axis has its own kind, cadence, scatter, wandering friction, temperatures and payload; what identification adds
comes from the pool of real answers. An alarm is a finding of any kind after a window without one; the year begins with
the first window after the baseline. Seeds from 20 000 on judge, those below were looked at while the watch was made.
"""

from __future__ import annotations

import argparse
import collections
import time

from scipy.stats import chi2

from monitor.drift import DriftRule, DriftState, judge
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import WEIGHT, Axis, Life, Pool

SETTINGS = (1.0, 0.3, 3.0)
BASELINE = 20
JUDGING = 20_000


def alarms(life: Life, rules: tuple[DriftRule, ...]) -> list[collections.Counter[str]]:
    """Alarms by kind in one healthy life, per rule."""
    states, before = [DriftState()] * len(rules), [False] * len(rules)
    counts = [collections.Counter() for _ in rules]
    for k in range(life.windows):
        one = life[k]
        for i, rule in enumerate(rules):
            states[i], findings = judge(states[i], one, rule)
            held = [finding.kind.value for finding in findings if finding.holds]
            if held and not before[i]:
                counts[i][held[0]] += 1
            before[i] = bool(held)
    return counts


def year(axis: Axis, pool: Pool, rates: tuple[float, ...]) -> list[collections.Counter[str]]:
    """Alarms by kind in one healthy year, per setting."""
    weight = 0.0 if FAMILIES[axis.family].horizontal else WEIGHT
    rules = tuple(DriftRule(false_alarms_per_year=rate, weight=weight) for rate in rates)
    return alarms(Life(axis, pool, BASELINE + round(365.25 * 24 / axis.every_hours)), rules)


def interval(count: int, years: float) -> tuple[float, float]:
    """95 % Poisson interval of the rate. [1/a]"""
    low = chi2.ppf(0.025, 2 * count) / 2 if count else 0.0
    return low / years, chi2.ppf(0.975, 2 * (count + 1)) / 2 / years


def told(count: int, years: float) -> str:
    low, high = interval(count, years)
    return f"{count / years:.3f} [{low:.3f}, {high:.3f}]"


def main(years: int, rates: tuple[float, ...], first: int) -> None:
    pool, begin = Pool(), time.process_time()
    sums = [collections.Counter() for _ in rates]
    axes = [collections.Counter() for _ in rates]
    wandering = [collections.Counter() for _ in rates]
    kinds: collections.Counter[float] = collections.Counter()
    for seed in range(first, first + years):
        axis = Axis.at_random(seed)
        kinds[axis.wandering] += 1
        for i, found in enumerate(year(axis, pool, rates)):
            sums[i] += found
            axes[i][sum(found.values())] += 1
            wandering[i][axis.wandering] += sum(found.values())
        done = seed - first + 1
        if done % 50 == 0 or done == years:
            spent = time.process_time() - begin
            print(f"{done} axis-years from seed {first}, {len(pool)} real answers, {spent:.0f} s of CPU", flush=True)
            for rate, counted, each, by in zip(rates, sums, axes, wandering, strict=True):
                total = told(sum(counted.values()), done)
                parts = ", ".join(f"{size:.1%}: {told(by[size], kinds[size])}" for size in sorted(kinds))
                print(f"  setting {rate:g}/a: {total} {dict(counted)} worst axis {max(each)}; wandering {parts}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--years", type=int, default=1000)
    parser.add_argument("--first", type=int, default=JUDGING)
    parser.add_argument("--rates", type=float, nargs="+", default=list(SETTINGS))
    given = parser.parse_args()
    main(given.years, tuple(given.rates), given.first)
