"""What the watch calls what, at the level of estimates: many axes per cause. `make causes`.

Thirty healthy windows, then fifteen with a cause of random size, each axis of its own kind, scatter and wandering,
errors from the pool of real answers. Right is what stands with the last window. Seeds below 20 000 are for choosing,
those from there on for judging.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses

import numpy as np
from scipy.stats import beta

from monitor.drift import DriftRule, DriftState, judge
from tests.monitor.studies.axis_years import JUDGING
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import WEIGHT, Axis, Life, Pool

BEFORE, AFTER = 30, 15
HORIZONTAL = 5  # family without a known mass: no weight tells the torque scale from friction, the mass itself does


def change_of(cause: str, size: float, part: float, friction: float) -> dict[str, float]:
    """Factors and forces of `cause` [1, N, kg], `part` of it done; `size` about 1."""
    match cause:
        case "guide worn":
            return dict.fromkeys(("coulomb", "static"), 1 + 0.15 * size * part)
        case "Coulomb level alone":
            return {"coulomb": 1 + 0.15 * size * part}
        case "thicker lubricant":
            return {"viscous": 1 + 0.5 * size * part}
        case "thinner lubricant":
            return {"viscous": 1 - 0.4 * size * part}
        case "film lost":
            return {"static": 1 + 0.25 * size * part, "coulomb": 1 + 0.1 * size * part,
                    "viscous": 1 - 0.35 * size * part, "stribeck": 1 + 0.8 * part}  # fmt: skip
        case "relubricated":
            return dict.fromkeys(("coulomb", "static"), 1 - 0.12 * size)
        case "jammed":
            return dict.fromkeys(("coulomb", "static"), 1 + 0.8 * size)
        case "torque read too large":
            return {"scale": 1 + 0.09 * size}
        case "torque read too small":
            return {"scale": 1 - 0.09 * size}
        case "payload not reported":
            return {"payload": 2.5 * size, "coulomb": 1 + 0.03 * size, "static": 1 + 0.03 * size}
        case "force from outside":
            return {"offset": 20.0 * size}
        case "a spot that resists":
            return {"latent": 0.06 * size * friction, "coulomb": 1.02, "static": 1.02}
    return {}


EXPECTED = {
    "nothing": "-", "guide worn": "wear", "Coulomb level alone": "wear", "thicker lubricant": "lubrication",
    "thinner lubricant": "lubrication", "film lost": "lubrication", "relubricated": "lubrication", "jammed": "jam",
    "torque read too large": "data_quality", "torque read too small": "data_quality",
    "payload not reported": "operating_point", "force from outside": "operating_point",
    "a spot that resists": "model_mismatch",
}  # fmt: skip


def called(cause: str, seed: int, pool: Pool) -> str:
    """What stands with the last window; - for nothing."""
    axis = dataclasses.replace(Axis.at_random(seed), load=0.0)
    if cause == "force from outside":  # on a vertical axis a force is a payload
        axis = dataclasses.replace(axis, family=HORIZONTAL)
    rng = np.random.default_rng([11, list(EXPECTED).index(cause), seed])
    size, sudden = float(rng.uniform(0.7, 1.4)), bool(rng.random() < 0.5)
    friction = float(axis.law.force(np.array([0.15]))[0])
    weight = 0.0 if FAMILIES[axis.family].horizontal else WEIGHT
    life, state, held = Life(axis, pool, BEFORE + AFTER), DriftState(), "-"
    for k in range(life.windows):
        part = 0.0 if k < BEFORE else 1.0 if sudden else min((k - BEFORE + 1) / (AFTER - 5), 1.0)
        state, findings = judge(
            state, life.at(k, change_of(cause, size, part, friction) if part else {}), DriftRule(weight=weight)
        )
        held = next((finding.kind.value for finding in findings if finding.holds), "-")
    return held


def main(axes: int, first: int) -> None:
    pool, right = Pool(), 0
    for cause, expected in EXPECTED.items():
        counts = collections.Counter(called(cause, seed, pool) for seed in range(first, first + axes))
        n = counts[expected]
        right += n
        low = beta.ppf(0.025, n, axes - n + 1) if n else 0.0
        high = beta.ppf(0.975, n + 1, axes - n) if n < axes else 1.0
        others = {name: count for name, count in counts.most_common() if name != expected}
        print(f"{cause:24s} {expected:16s} {n}/{axes} [{low:.0%}, {high:.0%}] else {others}", flush=True)
    print(f"right: {right} of {axes * len(EXPECTED)}, seeds from {first}, {len(pool)} real answers")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=40)
    parser.add_argument("--first", type=int, default=JUDGING)
    given = parser.parse_args()
    main(given.axes, given.first)
