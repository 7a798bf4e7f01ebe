"""What the watch calls what: simulated causes through identification and watch. `make confusion`.

Every axis is simulated, identified and judged window by window: 24 healthy windows, then 16 with the cause. Counted is
what stands at the end, and what stood most of the time after the first finding.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses

import numpy as np

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


def one_axis(cause: str, seed: int) -> str:
    """What stands at the end of one axis' story; - for nothing."""
    rng = np.random.default_rng([3, CAUSES.index(cause), seed])
    scenario = read_scenario("wear" if seed % 2 else "lubricant_loss")
    size = float(rng.uniform(0.6, 1.4))
    state, rule = DriftState(), drift_rule(scenario.axis, Config(site="study"))
    held: list[str] = []
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
    return collections.Counter(held).most_common(1)[0][0] if held else "-"


def main(axes: int) -> None:
    right = total = 0
    for cause in CAUSES:
        counts = collections.Counter(one_axis(cause, seed) for seed in range(axes))
        right, total = right + counts[EXPECTED[cause]], total + axes
        print(f"{cause:16s} {dict(counts)}", flush=True)
    print(f"right: {right} of {total}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=10)
    main(parser.parse_args().axes)
