"""What moves friction and nobody tells: seasons, and payloads on an axis without weight."""

import numpy as np
import pytest

from monitor.baseline import learn
from monitor.channels import PARTS, REFERENCES, SHAPES, Curve, Seen, film_of, numbers_of, reactions, shapes_of
from monitor.drift import DriftRule, Kind
from tests.monitor.estimates import LAW, estimate, friction
from tests.monitor.watching import delay_of, raised, watch

DRY = ("coulomb", "static")
MASS = 25.0  # kg


def season(number, rng, warmest, **more):
    """A window of a machine that sends no temperature; on the `warmest` day its hall is 5 K warmer than usual."""
    kelvin = 5.0 * np.cos(2 * np.pi * (number - warmest) / 365.25) + rng.standard_normal()
    thin = float(np.exp(-0.025 * kelvin))
    return estimate(number, rng, scatter=0.01, viscous=thin, stribeck=1 / thin, **more)


def test_a_season_nobody_told_raises_nothing():
    told = 0
    for axis in range(4):
        rng = np.random.default_rng([80, axis])
        _, held = watch(DriftRule(), (season(k, rng, 90 * axis) for k in range(365)))
        told += raised(held)
    assert told <= 1


def test_wear_is_found_though_nobody_tells_the_temperature():
    delays = []
    for axis in range(6):
        rng = np.random.default_rng([81, axis])
        state, _ = watch(DriftRule(), (season(k, rng, 60 * axis) for k in range(120)))
        worn = dict.fromkeys(DRY, 1.08)
        _, held = watch(DriftRule(), (season(120 + k, rng, 60 * axis, **worn) for k in range(20)), state)
        delays.append(delay_of(held))
        assert held[-1] == {Kind.WEAR}
    assert np.median(delays) <= 3


@pytest.mark.parametrize("payload", [1.0, 1.5, 2.5])  # kg, and 1.5 N of friction for each
def test_a_payload_on_a_horizontal_axis_is_no_wear_and_no_wrong_torque(payload):
    kinds = []
    for axis in range(8):
        rng = np.random.default_rng([82, axis])

        def one(k, mass, rng=rng, **more):
            mass += 0.1 * rng.standard_normal()
            return estimate(k, rng, latent=0.8, effects=(("moving_mass", mass, "kg"),), scatter=0.015, **more)

        state, _ = watch(DriftRule(), (one(k, MASS) for k in range(40)))
        heavier = dict.fromkeys(DRY, 1 + 1.5 * payload / LAW["coulomb"])
        _, held = watch(DriftRule(), (one(k, MASS + payload, **heavier) for k in range(40, 50)), state)
        kinds += [kind for now in held for kind in now]
    assert len(kinds) >= 70
    assert kinds.count(Kind.OPERATING_POINT) >= 0.97 * len(kinds)


def test_a_small_payload_is_no_wrong_torque():
    """5 N of weight more: a torque constant that is off by so much would scale friction as well."""
    kinds = []
    for axis in range(8):
        rng = np.random.default_rng([83, axis])
        rule, quiet = DriftRule(weight=196.0), {"latent": 0.8, "scatter": 0.015}
        state, _ = watch(rule, (estimate(k, rng, constant=0.0, temperature=20.0, **quiet) for k in range(40)))
        carried = {"constant": 6.4, **dict.fromkeys(DRY, 1.011)}
        _, held = watch(rule, (estimate(k, rng, temperature=20.0, **quiet, **carried) for k in range(40, 50)), state)
        kinds += [kind for now in held for kind in now]
    assert len(kinds) >= 40
    assert kinds.count(Kind.OPERATING_POINT) >= 0.95 * len(kinds)


def test_a_payload_is_told_soon_after_the_baseline_by_a_constant_force_that_hardly_scatters():
    """How far the constant force wanders is not known yet; but no axis wanders by more than a percent of friction."""
    told = 0
    for axis in range(8):
        rng = np.random.default_rng([86, axis])

        def one(k, force, rng=rng):
            force = ("constant_force", force + 0.02 * rng.standard_normal(), "N")
            return estimate(k, rng, temperature=20.0, latent=0.8, effects=(force,))

        state, _ = watch(DriftRule(weight=196.0), (one(k, 0.0) for k in range(24)))
        _, held = watch(DriftRule(weight=196.0), (one(k, 11.0) for k in range(24, 28)), state)
        told += held[0] == {Kind.OPERATING_POINT}
    assert told == 8


def test_a_film_feels_thickness_as_it_feels_speed():
    speeds, law = (0.05, 0.1, 0.3, 0.6, 1.0), LAW | {"static": 140.0}
    before, after = (
        friction(np.array(speeds), **(law | {"stribeck": 0.1 / thicker, "viscous": 180.0 * thicker}))
        for thicker in (0.99, 1.01)
    )
    now = friction(np.array(speeds), **law)
    expected = (after - before) / np.log(1.01 / 0.99)
    assert film_of(now, speeds, 0.1) == pytest.approx(expected, abs=0.03 * expected.max())


def test_reactions_are_what_the_numbers_do():
    rng = np.random.default_rng(84)
    seen = [Seen.of(estimate(k, rng, latent=0.8, constant=0.0)) for k in range(20)]
    baseline = learn(seen, 20, 0.03)
    force = baseline.friction

    def numbers(values):
        curve = Curve(baseline.speeds, tuple(values), tuple(values - 1), tuple(values + 1), 10.0)
        one = Seen(0, 1, curve, seen[0].others, 0.8, {})
        return numbers_of(one, baseline.speeds, baseline.extra, baseline.parts)[0]

    answers = reactions(baseline.speeds, baseline.channels, baseline.parts)
    names = [one.name for one in baseline.channels]
    known = [names.index(name) for name in (*SHAPES, *PARTS)]
    for k in range(REFERENCES):
        change = np.eye(REFERENCES)[k]
        assert (numbers(force + change) - numbers(force))[known] == pytest.approx(answers[known, k], abs=1e-9)


def test_the_filter_of_the_viscous_part_keeps_out_what_dry_friction_does():
    """A quiet fortnight shows no wandering: the filter must not lean on dry friction staying where it was."""
    leaks = []
    for axis in range(20):
        rng = np.random.default_rng([85, axis])
        seen = [Seen.of(estimate(k, rng, temperature=20.0, scatter=0.004, error=0.001)) for k in range(20)]
        baseline = learn(seen, 20, 0.03)
        leaks.append(float(np.array(baseline.parts[1][:-1]) @ shapes_of(baseline.friction, baseline.speeds)[0]))
    assert np.abs(leaks).max() < 0.2  # of a change of the dry part
