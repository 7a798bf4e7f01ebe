"""Blind recordings: repeatable, honest about what is hidden, and spoilt by sensors exactly as asked."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from . import foreign
from .cases import CaseSpec, draw_case, write_case
from .draws import CLOSED_KINDS, OPEN_KINDS, TWO_MASS, Facts, draw_effect, draw_excitation, draw_plant, draw_shapes
from .excitation import stamps
from .machine import run
from .parameters import EFFECTS, FOREIGN, SHAPES
from .recording import Sensors, record

T = stamps(10.0, 1e-3)
TRUTH = {
    "t": T, "position": np.sin(T), "motor_position": np.sin(T) + 1.0, "velocity": np.cos(T), "force_command": 100 * T,
}  # fmt: skip


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("kind", [*OPEN_KINDS, *CLOSED_KINDS])
def test_every_kind_of_motion_moves_every_kind_of_machine(kind):
    for seed, orientation in enumerate(("vertical", "horizontal", "rotary")):
        plant = draw_plant(rng(seed), orientation)
        truth = run(plant, draw_excitation(rng(seed), kind, plant, 10.0, 0.01, travel=None), step=5e-4)
        facts = Facts.of(truth)
        assert np.isfinite(truth["position"]).all()
        assert facts.half > 0.01
        assert facts.swing > 0.5 * plant.coulomb_force


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_drawn_effect_and_every_other_shape_of_it_changes_the_motion(name):
    generator = rng(list(EFFECTS).index(name))
    plant = draw_plant(generator, "horizontal")
    excitation = draw_excitation(generator, "loop_cycle", plant, 10.0, 0.01)
    plain = run(plant, excitation)
    effect = {name: draw_effect(generator, name, plant, Facts.of(plain))}
    hidden = run(replace(plant, effects=effect), excitation)
    difference = np.abs(hidden["force_command"] - plain["force_command"]).max()
    assert np.isfinite(hidden["position"]).all()
    assert difference > 1e-3 * plant.coulomb_force
    if name in SHAPES:
        other = run(replace(plant, effects=effect, shapes=draw_shapes(generator, effect)), excitation)
        moved = np.abs(other["force_command"] - hidden["force_command"])
        assert moved.max() > 0
        assert np.sqrt(np.mean(moved**2)) < plant.unit_force  # another curve, not another physics


def test_everything_outside_the_catalogue_has_coordinates_and_reaches_the_recording():
    assert set(foreign.IN_THE_EQUATIONS) <= set(foreign.OUTSIDE)
    assert set(FOREIGN) == set(foreign.IN_THE_EQUATIONS)
    plain = draw_case(CaseSpec(5, (), None, "loop_cycle", artefacts="clean", dirt=0.0, recordings=1, duration=12.0))
    for name in foreign.OUTSIDE:
        spec = CaseSpec(5, (), name, "loop_cycle", artefacts="clean", dirt=0.0, recordings=1, duration=12.0)
        case = draw_case(spec)
        assert case.labels["expected"] == "unexplained"
        ours, theirs = (c.recordings[0]["columns"] for c in (case, plain))
        same = np.array_equal(ours["force"], theirs["force"]) and np.array_equal(ours["position"], theirs["position"])
        assert not same, name


@pytest.mark.parametrize(
    ("excitation", "effects"),
    [("sine", ("rail_defect",)), ("loop_trapezoid", TWO_MASS), ("multisine", ()), ("still", ("force_offset",))],
)
def test_a_seed_gives_the_same_case_again_and_another_seed_another(excitation, effects):
    spec = CaseSpec(3, effects, None, excitation, artefacts="harsh", shapes="foreign", duration=8.0)
    one, same, other = draw_case(spec), draw_case(spec), draw_case(replace(spec, seed=4))
    for a, b in zip(one.recordings, same.recordings, strict=True):
        for name, values in a["columns"].items():
            assert np.array_equal(values, b["columns"][name])
    assert one.labels == same.labels
    assert one.labels["friction"] != other.labels["friction"]
    assert one.labels["expected"] == ("insufficient_data" if excitation == "still" else
                                      "explained" if effects else "no_mismatch")  # fmt: skip


def test_before_and_after_are_noted_and_the_first_is_healthy():
    spec = CaseSpec(8, ("force_offset",), None, "loop_sine", before=True, recordings=1, dirt=0.0, artefacts="clean")
    case = draw_case(replace(spec, duration=8.0))
    assert [entry["note"] for entry in case.recordings] == ["commissioning", "today"]
    healthy, ill = (np.mean(truth["force_command"][2000:]) for truth in case.truths)
    assert abs(healthy - ill) > 0.3 * abs(case.labels["effects"]["force_offset"]["force"])


def test_the_written_case_is_what_a_user_has_and_nothing_more(tmp_path):
    case = draw_case(CaseSpec(2, ("torque_ripple",), None, "sine", duration=5.0, recordings=2))
    path = write_case(case, tmp_path / "case")
    axis = tomllib.loads(path.read_text())
    assert len(axis["recording"]) == 2
    assert sorted(file.name for file in path.parent.iterdir()) == ["axis.toml", "recording_1.csv", "recording_2.csv"]
    assert "ripple" not in path.read_text()
    table = np.genfromtxt(path.parent / "recording_1.csv", delimiter=",", names=True)
    gain = axis["mechanics"].get("force_per_torque", 1 / axis["mechanics"]["Rm"])
    assert np.allclose(table["torque"] * gain, case.recordings[0]["columns"]["force"], atol=1e-5)


def test_sensors_sample_hold_delay_and_average():
    clean = record(TRUTH, Sensors(period=0.01), rng())
    assert np.allclose(clean["t"], 0.01 * np.arange(len(clean["t"])))
    assert np.allclose(clean["force"], 100 * clean["t"])
    late = record(TRUTH, Sensors(period=0.01, position_delay=0.05), rng())
    assert np.allclose(late["position"][5:], clean["position"][:-5])
    mean = record(TRUTH, Sensors(period=0.01, force="mean"), rng())
    assert np.allclose(mean["force"][:-1], 100 * (clean["t"][:-1] + 0.0045))
    motor = record(TRUTH, Sensors(period=0.01, side="motor", encoder_error=0.01, encoder_period=0.5), rng())
    assert 0.005 < np.abs(motor["position"] - clean["position"] - 1.0).max() <= 0.0101


def test_sensors_add_noise_grid_loss_and_slips_of_the_size_asked_for():
    rough = record(TRUTH, Sensors(position_noise=1e-3, position_step=5e-4, force_step=2.0, force_noise=1.0), rng())
    assert np.std(rough["position"] - np.sin(rough["t"])) == pytest.approx(1e-3, rel=0.1)
    assert np.allclose(rough["position"] / 5e-4, np.round(rough["position"] / 5e-4))
    assert np.allclose(rough["force"] / 2.0, np.round(rough["force"] / 2.0))
    thin = record(TRUTH, Sensors(lost=0.2, stale=0.1, gaps=((4.0, 5.0),), jitter=1e-3, speed_noise=0.01), rng())
    assert len(thin["t"]) == pytest.approx(0.8 * 900, rel=0.1)
    assert (np.diff(thin["t"]) > 0).all()
    assert not ((thin["t"] > 4.01) & (thin["t"] < 4.99)).any()
    assert np.std(np.diff(thin["t"])[np.diff(thin["t"]) < 0.014]) > 5e-4
    assert np.mean(np.diff(thin["position"]) == 0) == pytest.approx(0.08, abs=0.05)
    assert np.std(thin["velocity"] - np.cos(thin["t"])) == pytest.approx(0.01, rel=0.2)
    slipped = record(TRUTH, Sensors(slip=(5.0, 0.1)), rng())
    assert slipped["position"][700] - np.sin(7.0) == pytest.approx(0.1)
    with pytest.raises(ValueError, match="whole multiple"):
        record(TRUTH, Sensors(period=0.0015), rng())


def test_wandering_has_its_size_and_its_memory():
    x = foreign.wandering(stamps(2000.0, 0.01), 2.0, 0.1, rng())
    assert np.std(x) == pytest.approx(2.0, rel=0.05)
    assert np.corrcoef(x[:-10], x[10:])[0, 1] == pytest.approx(np.exp(-1), abs=0.03)
