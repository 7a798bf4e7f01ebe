"""`identified`, `not_informative` with what would inform, `bad_data` with its reason; judged by rates over machines."""

import dataclasses
import json

import numpy as np
import pytest

from identify.errors import InputError
from identify.identification import identify_friction
from identify.result import Verdict
from plant.axis import Axis, Drive, Mechanics, Orientation
from plant.errors import RecordingError
from plant.recording import Recording
from tests.identify.studies.machines import GAIN, RATED, Setting, coloured_noise, draw_case, draw_plant
from tests.reference.excitation import Torque, square, stamps
from tests.reference.machine import run

HEALTHY = draw_case(2, Setting("sine"))
MACHINES = range(5)


def broken(**channels):
    return dataclasses.replace(HEALTHY.recording, **channels)


def changed(channel, index, value):
    values = getattr(HEALTHY.recording, channel).copy()
    values[index] = value
    return broken(**{channel: values})


def cut(samples):
    return HEALTHY.recording.window(0, samples)


BAD = {
    "nan in the position": (changed("position", 7, np.nan), "position are not finite, the first is sample 7"),
    "a force that no machine has": (changed("force", 5, 1e300), "1 of 2000 samples of force are not finite"),
    "infinite force": (changed("force", slice(3, 5), np.inf), "2 of 2000 samples of force are not finite"),
    "nan in the clock": (changed("t", 0, np.nan), "samples of t are not finite"),
    "time runs backwards": (changed("t", 100, 0.2), "time does not rise"),
    "time stands still": (changed("t", 100, 0.99), "time does not rise"),
    "milliseconds": (broken(t=np.arange(2000) * 10.0), "10 s apart, not 0.01 s as the axis file says: another unit"),
    "microseconds": (broken(t=np.arange(2000) * 1e4), "10000 s apart, not 0.01 s"),
    "kiloseconds": (broken(t=np.arange(2000) * 1e-5), "1e-05 s apart, not 0.01 s"),
    "too short": (cut(50), "50 samples are too few"),
    "one sample": (cut(1), "1 samples are too few"),
    "constant position": (broken(position=np.full(2000, 0.3)), "moves by 0 m only"),
    "frozen force": (broken(force=np.full(2000, 12.5)), "constant at 12.5 N"),
    "broken into crumbs": (
        broken(t=np.arange(2000) * 0.01 + np.repeat(np.arange(200), 10)),
        "0 samples are left",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_unusable_samples_are_a_verdict_with_its_reason(name):
    recording, reason = BAD[name]
    result = identify_friction(recording, HEALTHY.axis)
    assert result.verdict is Verdict.BAD_DATA
    assert reason in result.reason
    assert result.parameters == {}
    json.dumps(result.to_dict(), allow_nan=False)


def test_the_papers_method_refuses_unusable_samples_too():
    result = identify_friction(BAD["nan in the position"][0], HEALTHY.axis, method="paper")
    assert result.verdict is Verdict.BAD_DATA


def test_an_unknown_method_is_one_clear_error():
    with pytest.raises(InputError, match=r"method 'magic' is not known: use one of ga\+polish, paper"):
        identify_friction(HEALTHY.recording, HEALTHY.axis, method="magic")


def test_channels_of_different_lengths_are_one_clear_error():
    with pytest.raises(RecordingError, match=r"force has shape \(1999,\), t has 2000"):
        broken(force=HEALTHY.recording.force[1:])


@pytest.mark.parametrize("excitation", ["sine", "multi", "loop"])
@pytest.mark.parametrize("noise", [1e-5, 1e-3])
def test_healthy_recordings_are_never_refused(excitation, noise):
    for seed in MACHINES:
        case = draw_case(40 + seed, Setting(excitation, noise=noise))
        result = identify_friction(case.recording, case.axis)
        assert result.verdict is Verdict.IDENTIFIED, result.reason
        assert result.reason is None


def drive(seed, force, *, noise=1e-4):
    """A horizontal machine of `seed` under `force(t, plant)` [N]: its axis, recording and plant."""
    rng = np.random.default_rng(seed)
    plant = dataclasses.replace(draw_plant(rng, 3.0), orientation="horizontal")
    t = stamps(20.0, 0.01)[:2000]
    dirt = 0.005 * plant.coulomb_force * coloured_noise(len(t), 0.01, 0.1, rng)
    happened = run(plant, Torque(t, force(t, plant) / GAIN), outer_force=dirt, step=5e-4)
    mechanics = Mechanics(Orientation.HORIZONTAL, plant.M, plant.J, plant.Rc, force_per_torque=GAIN)
    position = happened["position"] + noise * rng.standard_normal(len(t))
    return (
        Axis("x", mechanics, Drive(RATED)),
        Recording(t, happened["force_command"], position, sample_time=0.01),
        plant,
    )


def refusal(seed, force, **options):
    axis, recording, _ = drive(seed, force, **options)
    result = identify_friction(recording, axis)
    assert result.verdict in (Verdict.NOT_INFORMATIVE, Verdict.BAD_DATA)
    return result.reason


@pytest.mark.parametrize("seed", MACHINES)
def test_one_way_motion_is_refused_and_both_ways_are_asked_for(seed):
    reason = refusal(seed, lambda t, plant: plant.static_force * (1.1 + 0.4 * np.sin(2 * np.pi * 0.3 * t) ** 2))
    assert "coulomb_force" in reason
    assert "constant_force" in reason
    assert "one way in 100 % of its motion" in reason
    assert "strokes of equal length both ways would tell" in reason


@pytest.mark.parametrize("noise", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("seed", MACHINES)
def test_an_axis_that_sticks_is_refused(seed, noise):
    reason = refusal(seed, lambda t, plant: 0.8 * plant.static_force * np.sin(2 * np.pi * 0.3 * t), noise=noise)
    assert "that is no motion" in reason


@pytest.mark.parametrize("seed", MACHINES)
def test_motion_smaller_than_the_noise_is_refused(seed):
    reason = refusal(seed, lambda t, plant: 1.5 * plant.static_force * np.sin(2 * np.pi * 0.5 * t), noise=0.3)
    assert "that is no motion" in reason


def test_a_square_wave_does_not_tell_the_stribeck_effect_and_says_so():
    known = told = 0
    for seed in MACHINES:
        axis, recording, plant = drive(seed, lambda t, plant: square(t, 1.5 * plant.static_force, 0.2), noise=1e-3)
        result = identify_friction(recording, axis)
        stribeck = result.parameters["stribeck_velocity"]
        known += stribeck.identifiable
        told += stribeck.hint is not None and "slow strokes" in stribeck.hint
        for name in ("coulomb_force", "static_force"):
            interval = result.parameters[name].ci95
            assert interval is None or interval[0] - 5 <= getattr(plant, name) <= interval[1] + 5
    assert known <= 2
    assert told >= 3


def test_a_sine_tells_all_four():
    known = 0
    for seed in MACHINES:
        axis, recording, _ = drive(seed, lambda t, plant: 1.8 * plant.static_force * np.sin(2 * np.pi * 0.3 * t))
        result = identify_friction(recording, axis)
        known += all(parameter.identifiable for parameter in result.parameters.values())
        assert all(parameter.hint is None for parameter in result.parameters.values() if parameter.identifiable)
    assert known >= 4
