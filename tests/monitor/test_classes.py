"""Every cause is called by its name, through the watch itself."""

import numpy as np
import pytest

from monitor.channels import mover, unmoved
from monitor.drift import DriftRule, DriftState, Kind, judge
from tests.monitor.estimates import WEIGHT, estimate
from tests.monitor.watching import raised

RULE = DriftRule(weight=WEIGHT)
HEALTHY = {"latent": 0.8, "constant": 0.0}
DRY = ("coulomb", "static")
CAUSES = {
    "guide worn": (dict.fromkeys(DRY, 1.15), Kind.WEAR),
    "Coulomb level alone": ({"coulomb": 1.15}, Kind.WEAR),
    "thicker lubricant": ({"viscous": 1.5}, Kind.LUBRICATION),
    "thinner lubricant": ({"viscous": 0.6}, Kind.LUBRICATION),
    "dry at low speed": ({"static": 1.5}, Kind.LUBRICATION),
    "film lost": ({"static": 1.25, "coulomb": 1.1, "viscous": 0.65, "stribeck": 1.8}, Kind.LUBRICATION),
    "relubricated": (dict.fromkeys(DRY, 0.85), Kind.LUBRICATION),
    "jammed": (dict.fromkeys(DRY, 2.0), Kind.JAM),
    "torque read 8 % too large": ({"scale": 1.08}, Kind.DATA_QUALITY),
    "torque read 10 % too small": ({"scale": 0.9}, Kind.DATA_QUALITY),
    "payload of 2 kg": ({"constant": 19.6, "coulomb": 1.02, "static": 1.02, "latent": 1.2}, Kind.OPERATING_POINT),
    "a spot that resists": ({"latent": 5.0, "coulomb": 1.02, "static": 1.02}, Kind.MODEL_MISMATCH),
}


def run(estimates, state=None):
    state, held, last = state or DriftState(), [], {}
    for one in estimates:
        state, findings = judge(state, one, RULE)
        held.append({finding.kind for finding in findings if finding.holds})
        last = next((finding.evidence for finding in findings if finding.holds), last)
    return state, held, last


@pytest.mark.parametrize("cause", CAUSES)
def test_a_change_is_called_by_its_name(cause):
    change, kind = CAUSES[cause]
    right = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        known = {"temperature": 20.0 + seed} if "lubricant" in cause or "film" in cause else {}
        state, _, _ = run(estimate(k, rng, **HEALTHY, **known) for k in range(30))
        _, held, _ = run((estimate(k, rng, **(HEALTHY | change), **known) for k in range(30, 45)), state)
        right += held[-1] == {kind}
    assert right >= 9


def test_the_size_of_a_torque_error_is_told():
    rng = np.random.default_rng(0)
    state, _, _ = run(estimate(k, rng, **HEALTHY) for k in range(30))
    *_, evidence = run((estimate(k, rng, **HEALTHY, scale=1.08) for k in range(30, 45)), state)
    assert evidence["cause"] == "torque scale"
    assert evidence["size"] == pytest.approx(0.08, abs=0.01)


def test_scores_are_shares():
    rng = np.random.default_rng(0)
    state, _, _ = run(estimate(k, rng, **HEALTHY) for k in range(30))
    *_, evidence = run((estimate(k, rng, **HEALTHY, **dict.fromkeys(DRY, 1.1)) for k in range(30, 45)), state)
    assert sum(evidence["rivals"].values()) == pytest.approx(1.0)
    assert sum(evidence["shapes"].values()) == pytest.approx(1.0)
    assert evidence["score"] == evidence["rivals"]["wear"]


def warm(number, rng, temperature, **more):
    """A window at `temperature` of an axis whose lubricant thins by 2.5 %/K."""
    thickness = float(np.exp(-0.025 * (temperature - 21.0)))
    return estimate(number, rng, temperature=temperature, viscous=thickness, stribeck=1 / thickness, **HEALTHY, **more)


def test_temperature_is_corrected_for_and_wear_seen_through_it():
    rng = np.random.default_rng(1)
    temperatures = 21.0 + 4.0 * np.sin(np.arange(200) * 0.9) + rng.standard_normal(200)
    state, held, _ = run(warm(k, rng, temperatures[k]) for k in range(80))
    assert not any(held)
    slope = state.baseline.fit.slopes[0, 4] / state.baseline.friction[4]
    assert slope == pytest.approx(-0.012, abs=0.004)
    worn = (warm(k, rng, temperatures[k], **{n: 1 + 0.002 * (k - 80) for n in DRY}) for k in range(80, 130))
    _, held, _ = run(worn, state)
    assert held[-1] == {Kind.WEAR}


def test_a_summer_far_beyond_the_baseline_raises_nothing():
    """Learned from 8 to 20 degC, 34 in summer: a straight line is off by a quarter of what August does."""
    count = 0
    for seed in range(4):
        rng = np.random.default_rng([4, seed])
        seasons = 14.0 + 10.0 * (1.0 - np.cos(2 * np.pi * np.arange(365) / 365)) + 3.0 * rng.standard_normal(365)
        _, held, _ = run(warm(k, rng, seasons[k], scatter=0.005, error=0.001) for k in range(365))
        count += raised(held)
    assert count <= 2


@pytest.mark.parametrize(("name", "value"), [("temperature", -30.0), ("temperature", 80.0), ("load", 2.5)])
def test_what_moves_friction_can_be_told_in_its_own_unit(name, value):
    assert unmoved(name, mover(name, value)) == pytest.approx(value)
    assert np.isfinite(mover(name, 1e12 if name == "temperature" else value))


def test_a_temperature_that_the_baseline_never_saw_is_no_wear():
    rng = np.random.default_rng(2)
    state, _, _ = run(warm(k, rng, 21.0 + 0.3 * rng.standard_normal()) for k in range(30))
    _, held, evidence = run((warm(k, rng, 9.0) for k in range(30, 36)), state)
    assert set().union(*held) == {Kind.OPERATING_POINT}
    assert sum(map(bool, held)) >= 3
    assert evidence["covered"]["temperature"][0] > 19
    _, held, _ = run((warm(k, rng, 21.0, **dict.fromkeys(DRY, 1.2)) for k in range(36, 40)), state)
    assert held[-1] in ({Kind.WEAR}, {Kind.JAM})  # where it was learned, it still sees


def test_growing_parameters_of_a_promoted_effect_are_wear_with_its_name():
    rng = np.random.default_rng(3)

    def one(k, amplitude):
        spot = ("rail_defect.amplitude", amplitude + 0.5 * rng.standard_normal(), "N")
        return estimate(k, rng, **HEALTHY, effects=(spot,))

    state, _, _ = run(one(k, 20.0) for k in range(30))
    _, held, evidence = run((one(k, 20.0 + 0.5 * (k - 30)) for k in range(30, 70)), state)
    assert held[-1] == {Kind.WEAR}
    assert evidence["indicator"] == "rail_defect.amplitude"


def test_a_payload_that_is_taken_off_again_ends_at_once_and_turns_into_nothing_else():
    """Forty days with a payload nobody reported, on a machine that tells no temperature."""
    late = []
    for seed in range(6):
        rng = np.random.default_rng([5, seed])
        state, _, _ = run(estimate(k, rng, **HEALTHY, scatter=0.02) for k in range(60))
        loaded = CAUSES["payload of 2 kg"][0]
        state, held, _ = run((estimate(k, rng, **HEALTHY | loaded, scatter=0.02) for k in range(60, 100)), state)
        assert held[-1] == {Kind.OPERATING_POINT}
        _, held, _ = run((estimate(k, rng, **HEALTHY, scatter=0.02) for k in range(100, 120)), state)
        assert set().union(*held) <= {Kind.OPERATING_POINT}
        late.append(sum(map(bool, held)))
    assert max(late) <= 3
