"""What judges a name where one-second free runs cannot, and how well its parameters can be known at best."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch.compare import Comparison, run_lengths
from identify.mismatch.floors import no_better, within_reach
from identify.mismatch.guise import Unknown
from identify.mismatch.result import FoundEffect, Quantity
from identify.mismatch.rules import _hidden_state, refusal
from tests.identify.test_nameless import drag_on_a_machine


def fitted(level, bump, stribeck_velocity, mass):
    law = np.array([level, bump, 1.0 / stribeck_velocity, 20.0, mass, 0.0])
    return SimpleNamespace(x=np.zeros(6), problem=SimpleNamespace(law=lambda _: law[:, None]))


@pytest.mark.parametrize(
    ("machine", "lengths"),
    [
        (fitted(80.0, 8.0, 0.14, 17.0), (1.0,)),  # heavy: errors grow e times in half a second
        (fitted(80.0, 40.0, 0.1, 20.0), (1.0, 5.0 / 19.0)),
        (fitted(70.0, 50.0, 0.09, 8.0), (1.0, 0.2)),  # light and sticky: 67 times a second
        (fitted(70.0, 0.0, 0.09, 8.0), (1.0,)),  # friction that does not fall
    ],
)
def test_free_runs_that_judge_may_be_short_where_the_machine_makes_much_of_a_small_error(machine, lengths):
    assert run_lengths(machine) == pytest.approx(lengths)


def test_overwhelming_evidence_that_takes_latent_force_away_needs_no_free_run():
    drag = drag_on_a_machine(25.0)

    def weighed(**changed):
        seen = {"foreseen": 2000.0, "foreseen_z": 6.0, "again": 1500.0, "lacking": 0.2} | changed
        return refusal(*drag, Comparison(-5000.0, 9.0, -4000.0, 1.2, 1.3, **seen), 10.0)

    assert weighed() is None
    assert weighed(foreseen_z=2.7) is None, "fitted and unseen data agree together"
    for weak in ({"lacking": 0.5}, {"again": 90.0}, {"foreseen_z": 2.0}):
        assert "predict" in weighed(**weak)


@pytest.mark.parametrize(
    ("wave", "z", "hidden"),
    [(("amplitude", "phase"), 14.8, True), (("amplitude", "phase"), 5.0, False), (None, 14.8, False)],
)
def test_a_wave_that_all_places_tell_needs_no_free_run(wave, z, hidden):
    """A free run that errs by a part of its period has it at the wrong places: a judge's ripple of 4.4 mm left 1.6."""
    guise = SimpleNamespace(stiff=False, wave=wave)
    told = Comparison(-7429.0, z, -6160.0, 0.85, 1.6, foreseen=4283.0, foreseen_z=7.8, again=3348.0, lacking=0.91)
    assert _hidden_state(guise, told) is hidden


def test_no_parameter_is_better_known_than_the_curve_it_belongs_to():
    values = {
        "amplitude": Quantity(40.0, "N", (39.9, 40.1)), "centre": Quantity(0.5, "m", (0.4999, 0.5001)),
        "width": Quantity(0.02, "m", (0.0199, 0.0201)),
    }  # fmt: skip
    known = no_better("rail_defect", values, 0.0, 1.0)
    low, high = known["amplitude"].ci95
    assert (low, high) == pytest.approx((40.0 - 1.204, 40.0 + 1.204), abs=0.01)
    assert known["centre"].ci95 == pytest.approx((0.498, 0.502), abs=1e-5)
    assert known["width"].ci95 == pytest.approx((0.018, 0.022), abs=1e-5)
    wide = {"time_constant": Quantity(0.003, "s", (0.001, 0.005))}
    assert no_better("actuator_lag", wide, 0.004, 1.0)["time_constant"].ci95 == pytest.approx((0.0, 0.00747), abs=1e-5)
    nothing = {"gap": Quantity(1e-3, "m", None)}
    assert no_better("backlash", nothing, 0.0, 1.0) == nothing


@pytest.mark.parametrize(("rests", "high"), [(1.07, 172.0), (9.0, 135.7)])
def test_what_endless_rest_gives_is_known_as_well_as_how_fast(rests, high):
    """All rests took 1.02 s: a rise of 128 N (122 to 135) in 0.3 s (0.12 to 0.73) was one of 168 N in 0.94 s."""
    rise, constant = Quantity(128.5, "N", (122.4, 134.6)), Quantity(0.296, "s", (0.118, 0.732))
    known = no_better("dwell_time_stiction", {"stiction_rise": rise, "time_constant": constant}, 0.0, rests)
    assert known["stiction_rise"].ci95[1] == pytest.approx(high, abs=1.5)
    assert known["stiction_rise"].ci95[0] == pytest.approx(119.7, abs=1.8)


def test_no_interval_is_wider_than_where_the_parameter_was_looked_for():
    """A belt that one stroke told: a damping from -0.9 to 9e23 N s/m."""
    guise = SimpleNamespace(
        unknowns=(Unknown("stiffness", 1e4, 1e3, 1e6, log=True), Unknown("damping", 1.0, 0.3, 1e4, log=True)),
        optional=lambda name: name == "damping",
    )
    values = {"stiffness": Quantity(1.2e5, "N/m", (7e4, 2e5)), "damping": Quantity(180.0, "N*s/m", (-0.9, 9e23))}
    known = within_reach(FoundEffect("transmission_compliance", 0.5, values, 1.0), guise).parameters
    assert known["stiffness"] == values["stiffness"]
    assert known["damping"] == Quantity(180.0, "N*s/m", (0.0, 1e4))
    beyond = {"damping": Quantity(2e4, "N*s/m", (1.0, 4e4))}
    assert within_reach(FoundEffect("x", 0.5, beyond, 1.0), guise).parameters["damping"].ci95 == (1.0, 2e4)
