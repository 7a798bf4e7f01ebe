"""Effects that an axis is known to have are fitted together with its friction."""

import dataclasses

import numpy as np
import pytest

from identify import identify_friction
from identify.errors import InputError
from plant.axis_file import read_axis
from plant.presets import paper_axis, paper_friction, paper_torque
from plant.recording import Recording
from plant.recording_files import read_recording_entry
from plant.simulation import simulate
from tests.reference.cases import CaseSpec, draw_case, write_case


@pytest.fixture(scope="module")
def defective(tmp_path_factory):
    """A machine with a bump on its rail, by the independent simulator: truth, axis, two recordings."""
    folder = tmp_path_factory.mktemp("defective")
    case = draw_case(CaseSpec(6100, ("rail_defect",), excitation="multisine", duration=20.0, size=1.0))
    axis = read_axis(write_case(case, folder))
    return case.labels, axis, [read_recording_entry(entry, axis) for entry in axis.recordings]


@pytest.fixture(scope="module")
def known(defective):
    _, axis, recordings = defective
    return identify_friction(recordings[1], axis, effects=("rail_defect",))


def test_a_known_effect_is_fitted_with_the_friction_and_both_are_right(defective, known):
    labels, _, _ = defective
    truth = dict(labels["friction"])
    truth |= {f"rail_defect.{name}": value for name, value in labels["effects"]["rail_defect"].items()}
    assert known.verdict == "identified"
    assert set(truth) | {"constant_force"} == set(known.parameters)
    for name, value in truth.items():
        low, high = known.parameters[name].ci95
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        assert abs(value - middle) < 2.0 * half  # twice the 95 % interval: seven intervals, one window
        assert half < 0.3 * abs(value)
    assert known.parameters["rail_defect.centre"].unit == "m"


def test_the_curve_of_friction_is_freed_from_what_the_effect_explains(defective, known):
    labels, axis, recordings = defective
    f = labels["friction"]
    plain = identify_friction(recordings[1], axis)
    true = f["coulomb_force"] + 0.3 * f["viscous_coefficient"]
    known_error, plain_error = (abs(float(one.curve_at([0.3])[0][0]) - true) for one in (known, plain))
    assert known_error < 0.01 * true
    assert known.criterion < 0.2 * plain.criterion
    assert float(known.curve_at([0.3])[1][0]) < float(plain.curve_at([0.3])[1][0])
    assert known_error < plain_error + 0.005 * true


def test_a_last_answer_competes_and_does_not_bind(defective, known):
    _, axis, recordings = defective
    values = {name: parameter.value for name, parameter in known.parameters.items()}
    misled = values | {"rail_defect.centre": values["rail_defect.centre"] + 0.05, "rail_defect.amplitude": -20.0}
    for start in (values, misled):
        warm = identify_friction(recordings[1], axis, effects=("rail_defect",), start=start, seed=7)
        for name, parameter in known.parameters.items():
            low, high = parameter.ci95
            assert abs(warm.parameters[name].value - parameter.value) < 0.1 * (high - low), name


def test_an_effect_that_this_axis_cannot_show_is_named_and_left_out(defective):
    _, axis, recordings = defective
    rigid = dataclasses.replace(axis, mechanics=dataclasses.replace(axis.mechanics, J=0.0))
    result = identify_friction(recordings[1], rigid, effects=("backlash",))
    assert any("backlash" in note for note in result.preprocessing)
    assert not any(name.startswith("backlash") for name in result.parameters)


def test_a_promoted_offset_takes_the_place_of_the_constant_force():
    """Vertical, mass known: beside it, the constant force's prior (1 % of rated) would be all that is known of both."""
    axis = paper_axis()
    torque = paper_torque(axis)
    offset = {"force_offset": {"force": 25.0}}
    run = simulate(axis, paper_friction(), torque, sample_time=0.01, effects=offset)
    noise = 2e-5 * np.random.default_rng(3).standard_normal(len(torque))
    seen = Recording(t=run.t, force=axis.mechanics.gain * torque, position=run.position + noise, sample_time=0.01,
                     hold=axis.stream.hold)  # fmt: skip
    result = identify_friction(seen, axis, effects=("force_offset",))
    assert "constant_force" not in result.parameters
    found = result.parameters["force_offset.force"]
    half = 0.5 * (found.ci95[1] - found.ci95[0])
    assert half < 1.0 < 0.01 * axis.drive.rated_force
    assert abs(found.value - 25.0) < 2.0 * half


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"effects": ("rail_defects",)}, "rail_defect"),
        ({"effects": ("rail_defect",), "method": "paper"}, "'paper' fits no effects"),
        ({"effects": ("rail_defect",), "criterion": "output_error"}, "'output_error' fits no effects"),
    ],
)
def test_wrong_wishes_are_told(defective, options, word):
    _, axis, recordings = defective
    with pytest.raises(InputError, match=word):
        identify_friction(recordings[1], axis, **options)
