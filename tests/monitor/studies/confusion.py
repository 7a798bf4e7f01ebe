"""What the watch calls what: simulated causes through identification and watch. `make confusion`.

Every axis is simulated, identified and judged window by window: 24 healthy windows, then 16 with the cause. Counted is
what stood most of the time after the cause began, and in brackets how many windows it took until something stood.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses

import numpy as np
from scipy.stats import beta

from monitor.axis_run import drift_rule
from monitor.config import Config
from monitor.drift import DriftState, judge
from plant.ageing import Condition
from plant.scenario_file import read_scenario
from plant.sensors import freeze_position
from tests.monitor.studies.offline import estimate_of

BEFORE, AFTER = 24, 16
CAUSES = (
    "nothing",
    "wear",
    "lubricant loss",
    "warm-up",
    "payload",
    "torque constant",
    "sensor freeze",
    "rail defect",
    "jam",
)
EXPECTED = {
    "nothing": "-", "wear": "wear", "lubricant loss": "lubrication", "warm-up": "-", "payload": "operating_point",
    "torque constant": "data_quality", "sensor freeze": "data_quality", "rail defect": "model_mismatch", "jam": "jam",
}  # fmt: skip


def one_axis(cause: str, seed: int) -> tuple[str, int]:
    """What stood most of the time in one axis' story, - for nothing; and with which window something first stood."""
    rng = np.random.default_rng([3, CAUSES.index(cause), seed])
    scenario = read_scenario("wear" if seed % 2 else "lubricant_loss")
    size = float(rng.uniform(0.6, 1.4))
    state, rule = DriftState(), drift_rule(scenario.axis, Config(site="study"))
    held: list[str] = []
    first = 0
    for number in range(BEFORE + AFTER):
        part = max(number - BEFORE + 1, 0) / AFTER
        warmth = float(rng.normal(0, 2)) + (10.0 * size * min(3 * part, 1) if cause == "warm-up" else 0.0)
        thick = float(np.exp(-0.025 * warmth))
        chance = np.exp(rng.standard_normal(4) * (0.01, 0.015, 0.03, 0.01))
        condition = Condition(temperature=21 + warmth).scaled(
            chance[0], chance[1], chance[2] / thick, chance[3] * thick
        )
        if cause == "wear":
            condition = condition.scaled(1 + 0.2 * size * part, 1 + 0.2 * size * part)
        elif cause == "lubricant loss":
            condition = condition.scaled(1 + 0.1 * part, 1 + 0.3 * size * part, 1 + 0.8 * part, 1 - 0.4 * size * part)
        elif cause == "payload" and part:
            condition = dataclasses.replace(condition, load=2.0 * size, dry_force=3.0 * size)
        elif cause == "rail defect" and part:
            spot = ("rail_defect", {"amplitude": 30 * size * part, "centre": 1.2, "width": 0.03})
            condition = dataclasses.replace(condition, effects=(spot,))
        elif cause == "jam" and part:
            condition = dataclasses.replace(condition, dry_force=35.0 * size)
        law = condition.friction(scenario.friction)
        seen = scenario._run(condition, law, f"{cause} {seed}")
        if cause == "torque constant" and part:
            seen = dataclasses.replace(seen, force=seen.force * (1 + 0.08 * size * (1 if seed % 4 < 2 else -1)))
        axis = scenario.axis
        seen = scenario.sensors.apply(seen, axis.mechanics.gain, axis.drive.rated_force, rng)
        if cause == "sensor freeze" and part:
            seen = freeze_position(seen, float(rng.uniform(2, 15)), 2.3 * size)
        found = estimate_of(seen, dataclasses.replace(axis, recordings=()), number * 43_200 * 10**9, number)
        state, findings = judge(state, found, rule)
        if number >= BEFORE:
            held += [finding.kind.value for finding in findings if finding.holds]
            if held and not first:
                first = number - BEFORE + 1
    return (collections.Counter(held).most_common(1)[0][0] if held else "-"), first


def interval(right: int, total: int) -> tuple[float, float]:
    """95 % interval of a share (Clopper & Pearson 1934)."""
    low = beta.ppf(0.025, right, total - right + 1) if right else 0.0
    high = beta.ppf(0.975, right + 1, total - right) if right < total else 1.0
    return float(low), float(high)


def main(axes: int, first: int, causes: tuple[str, ...]) -> None:
    """One row per cause; seeds `first` and following."""
    right = total = 0
    print(f"{'cause':16s} {'expected':16s} right  95 % interval  windows to the first finding  called")
    for cause in causes:
        told = [one_axis(cause, seed) for seed in range(first, first + axes)]
        counts = collections.Counter(name for name, _ in told)
        good = counts[EXPECTED[cause]]
        right, total = right + good, total + axes
        low, high = interval(good, axes)
        found = [window for _, window in told if window]
        took = f"median {np.median(found):.0f}" if found else "none"
        called = ", ".join(f"{name} {count}" for name, count in counts.most_common())
        print(
            f"{cause:16s} {EXPECTED[cause]:16s} {good}/{axes}  {low:.2f} to {high:.2f}  {took:12s}  {called}",
            flush=True,
        )
    low, high = interval(right, total)
    print(f"right: {right} of {total}, 95 % {low:.2f} to {high:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--cause", action="append", choices=CAUSES, help="only this one (may be repeated)")
    chosen = parser.parse_args()
    main(chosen.axes, chosen.first, tuple(chosen.cause or CAUSES))
