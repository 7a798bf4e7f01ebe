"""Lives of the scenario `healthy`, many of them: does friction that wanders by a percent over days cry wolf?

Half a year each, a window every seven hours, errors from the pool of real answers, at the default setting:
`make healthy-lives ARGS="--lives 120"`.
"""

from __future__ import annotations

import argparse
import collections

from monitor.drift import DriftRule
from tests.monitor.studies.axis_years import alarms, interval
from tests.monitor.studies.synthetic import WEIGHT, Axis, Life, Pool

DAYS, EVERY = 180.0, 7.0


def main(lives: int, first: int) -> None:
    pool, sums = Pool(), collections.Counter()
    for seed in range(first, first + lives):
        axis = Axis(
            0, seed, every_hours=EVERY, scatter=0.015, wandering=0.01, daily=1.5, yearly=3.0, weather=1.0, warmth=5.0
        )
        life = Life(axis, pool, round(DAYS * 24 / EVERY))
        sums += alarms(life, (DriftRule(weight=WEIGHT),))[0]
    years = lives * (DAYS - 20 * EVERY / 24) / 365.25
    low, high = interval(sum(sums.values()), years)
    print(f"{lives} lives of `healthy` from seed {first}, {years:.0f} axis-years watched: false alarms {dict(sums)}, "
          f"{sum(sums.values()) / years:.2f} a year [{low:.2f}, {high:.2f}]")  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lives", type=int, default=120)
    parser.add_argument("--first", type=int, default=40_000)
    given = parser.parse_args()
    main(given.lives, given.first)
