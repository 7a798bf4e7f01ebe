"""The catalogue: complete, second order, nothing when absent, free to combine, and strict about numbers."""

import ast
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from plant.axis import Axis, Mechanics, Orientation
from plant.effects import CATALOGUE, Surroundings, find, names
from plant.errors import InputError, ParameterError
from plant.friction import StribeckFriction
from plant.kernels.laws import LANES
from plant.machine import checked_values, march, plan
from plant.presets import paper_axis, paper_friction, paper_torque
from plant.simulation import simulate
from tests.plant.effect_examples import EXAMPLES, absent

AXIS, FRICTION = paper_axis(), paper_friction()
TORQUE = paper_torque(AXIS)
MIDDLE = 0.2
PARAMETERS = [(name, i) for name in CATALOGUE for i in range(len(find(name).parameters))]

# effects.md, "Parameter names in JSON results": own parameters, then what `derive` adds.
REPORTED = {
    "force_offset": [("force", "N")],
    "coulomb_asymmetry": [("asymmetry_ratio", "1"), ("coulomb_difference_half", "N")],
    "viscous_asymmetry": [("asymmetry_ratio", "1"), ("viscous_difference_half", "N*s/m")],
    "position_dependent_friction": [("relative_slope", "1/m"), ("slope", "N/m")],
    "rail_defect": [("amplitude", "N"), ("centre", "m"), ("width", "m")],
    "presliding_hysteresis": [("bristle_stiffness", "N/m"), ("bristle_damping", "N*s/m")],
    "backlash": [("gap", "m")],
    "transmission_compliance": [("stiffness", "N/m"), ("damping", "N*s/m")],
    "torque_ripple": [("period", "m"), ("amplitude", "N"), ("relative_amplitude", "1")],
    "pulley_eccentricity": [("relative_eccentricity", "1"), ("period", "m")],
    "load_dependent_friction": [("coefficient", "1")],
    "thermal_drift": [("relative_drop", "1"), ("time_constant", "s")],
    "quadratic_drag": [("coefficient", "N*s^2/m^2")],
    "position_spring": [("stiffness", "N/m"), ("rest_position", "m")],
    "inertia_error": [("mass_error", "kg")],
    "torque_scale_error": [("relative_error", "1")],
    "actuator_lag": [("time_constant", "s")],
    "dead_time": [("delay", "s")],
    "torque_saturation": [("limit", "N*m")],
    "dwell_time_stiction": [("stiction_rise", "N"), ("time_constant", "s")],
    "end_stop": [("position", "m"), ("stiffness", "N/m")],
    "step_change": [("step", "N"), ("time", "s")],
}


def run(effects, **more):
    return simulate(AXIS, FRICTION, TORQUE, effects=effects, middle=MIDDLE, **more)


def test_the_catalogue_is_that_of_effects_md_and_every_effect_is_one_small_file():
    assert list(CATALOGUE) == list(REPORTED)
    assert set(names()) >= set(CATALOGUE)
    folder = Path(find("backlash").prepare.__code__.co_filename).parent
    for name in CATALOGUE:
        text = (folder / f"{name}.py").read_text()
        assert (ast.get_docstring(ast.parse(text)) or "").startswith(f"{name}: ")
        assert len(text.splitlines()) < 100
        assert find(name).source


@pytest.mark.parametrize("name", CATALOGUE)
def test_reported_names_and_units_are_those_of_effects_md(name):
    effect = find(name)
    values = {p.name: 0.5 for p in effect.parameters}
    own = [(p.name, p.unit) for p in effect.parameters if p.reported]
    further = effect.derive(values, np.array([90.0, 60.0, 0.1, 180.0]))
    assert own + [(key, unit) for key, (_, unit) in further.items()] == REPORTED[name]


def test_derived_quantities_are_newtons_where_ratios_were():
    friction = np.array([90.0, 60.0, 0.1, 180.0])
    assert find("coulomb_asymmetry").derive({"asymmetry_ratio": 0.1}, friction)["coulomb_difference_half"][0] == 9.0
    assert find("viscous_asymmetry").derive({"asymmetry_ratio": 0.1}, friction)["viscous_difference_half"][0] == 18.0
    assert find("position_dependent_friction").derive({"relative_slope": 2.0}, friction)["slope"][0] == 180.0


@pytest.mark.parametrize(("name", "i"), PARAMETERS)
def test_a_parameter_out_of_range_names_itself_its_value_its_range_and_its_unit(name, i):
    effect = find(name)
    p = effect.parameters[i]
    low, high = p.allowed
    assert low <= p.plausible[0] < p.plausible[1] <= high
    bad = [math.nan]
    bad += [low - 1.0] if math.isfinite(low) else []
    bad += [high + 1.0] if math.isfinite(high) else []
    bad += [-math.inf] if p.absent != -math.inf else []
    bad += [math.inf] if p.absent != math.inf else []
    for value in bad:
        with pytest.raises(ParameterError) as error:
            effect.values({**EXAMPLES[name], p.name: value}, AXIS.mechanics)
        line = str(error.value)
        assert line.startswith(f"{name}.{p.name} is {value:g}")
        assert p.unit == "1" or line.endswith(f" {p.unit}")
        assert "finite" in line or ">=" in line or (f"{low:g}" in line and f"{high:g}" in line)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_example_changes_the_motion(name):
    moved = np.abs(run({name: EXAMPLES[name]}, substeps=4).position - run({}, substeps=4).position).max()
    assert moved > (1e-6 if name == "backlash" else 5e-5)


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_of_zero_size_is_the_baseline_bit_for_bit(name):
    assert find(name).vanishes(checked_values(plan(Surroundings.of(AXIS), (name,)), {name: absent(name)}))
    for reached, baseline in zip(
        *((path.position, path.velocity, path.friction_force) for path in (run({name: absent(name)}), run({}))),
        strict=True,
    ):
        assert np.array_equal(reached, baseline)


@pytest.mark.parametrize("name", [name for name in CATALOGUE if find(name).laws])
def test_the_law_itself_adds_nothing_at_zero_size(name):
    """Beside a candidate that has the effect, so that the law does run."""
    chosen = plan(Surroundings.of(AXIS, MIDDLE), (name,))
    mixed = np.hstack([checked_values(chosen, {name: absent(name)}), checked_values(chosen, {name: EXAMPLES[name]})])
    bare = plan(Surroundings.of(AXIS, MIDDLE), ())
    friction = np.repeat(FRICTION.as_array[:, np.newaxis], 2, axis=1)
    force = AXIS.mechanics.gain * TORQUE
    t = 0.01 * np.arange(len(force))
    paths = []
    for blocks in (chosen.blocks(friction, mixed), bare.blocks(friction, np.empty((0, 2)))):
        blocks.place(0.0, 0.0, force[0])
        paths.append(march(blocks, t, force[:-1], force[:-1], 4))
    assert np.array_equal(paths[0][:, :, 0], paths[1][:, :, 0])
    assert not np.array_equal(paths[0][:, :, 1], paths[1][:, :, 1])


# Order 2 but for rest that begins inside a sub-step.
ORDER = {"dwell_time_stiction": 0.7}


@pytest.mark.parametrize("name", ["baseline", *CATALOGUE])
def test_halving_the_step_quarters_the_error(name):
    effects = {} if name == "baseline" else {name: EXAMPLES[name]}
    reference = run(effects, substeps=640).position
    steps = (5, 10, 20, 40)
    errors = [float(np.abs(run(effects, substeps=count).position - reference).max()) for count in steps]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    print(
        f"\n{name:28s} order {order:.2f}  " + "  ".join(f"{c}: {e:.1e} m" for c, e in zip(steps, errors, strict=True))
    )
    assert order > ORDER.get(name, 1.7)
    assert errors[0] < 8e-5


@pytest.mark.parametrize("name", ["baseline", "coulomb_asymmetry", "transmission_compliance", "dead_time"])
@pytest.mark.parametrize("shape", [np.sin, lambda x: np.sign(np.sin(x))], ids=["sine", "square"])
def test_reversals_that_do_not_rest_are_second_order_too(name, shape):
    """A fast motion turns under a force far beyond the static one, in the middle of a sub-step."""
    flat = Axis("flat", Mechanics(Orientation.HORIZONTAL, M=20.0, J=0.01, Rc=0.045, force_per_torque=100.0))
    torque = 2.3 * shape(2 * np.pi * 0.93 * 0.01 * np.arange(1000))
    law = StribeckFriction(50.0, 80.0, 0.05, 100.0)
    effects = {} if name == "baseline" else {name: EXAMPLES[name]}

    def position(substeps):
        return simulate(flat, law, torque, sample_time=0.01, effects=effects, substeps=substeps).position

    reference = position(1600)
    errors = [float(np.abs(position(count) - reference).max()) for count in (4, 16, 64)]
    print(f"\n{name:28s} 4, 16, 64: " + "  ".join(f"{e:.1e} m" for e in errors))
    most = (1e-4, 1e-5, 1e-6) if shape is np.sin else (1e-3, 5e-4, 5e-5)  # jumps of 460 N are harder
    assert all(error < limit for error, limit in zip(errors, most, strict=True))


@pytest.mark.parametrize("name", ["baseline", *CATALOGUE])
def test_the_default_substeps_settle_the_position(name):
    effects = {} if name == "baseline" else {name: EXAMPLES[name]}
    default = run(effects)
    reference = run(effects, substeps=640)
    error = np.abs(default.position - reference.position).max()
    print(f"\n{name:28s} {default.substeps:4d} sub-steps by default, error {error:.1e} m")
    assert error < 2e-5


def test_any_subset_runs_together():
    everything = run(EXAMPLES, substeps=60)
    assert np.isfinite(everything.position).all()
    rng = np.random.default_rng(0)
    for _ in range(12):
        some = {name: EXAMPLES[name] for name in rng.choice(CATALOGUE, size=4, replace=False)}
        assert np.isfinite(run(some, substeps=40).position).all(), list(some)


def test_the_order_of_naming_does_not_matter():
    some = ["rail_defect", "actuator_lag", "coulomb_asymmetry", "torque_ripple"]
    paths = [
        run({name: EXAMPLES[name] for name in order}, substeps=4).position
        for order in itertools.islice(itertools.permutations(some), 6)
    ]
    assert all(np.array_equal(path, paths[0]) for path in paths)


def test_a_candidate_does_not_feel_its_neighbours():
    chosen = plan(Surroundings.of(AXIS, MIDDLE), ("rail_defect", "presliding_hysteresis"))
    values = checked_values(chosen, {name: EXAMPLES[name] for name in ("rail_defect", "presliding_hysteresis")})
    m = LANES + 5
    many = values * np.linspace(0.8, 1.2, m)
    friction = np.repeat(FRICTION.as_array[:, np.newaxis], m, axis=1)
    force = AXIS.mechanics.gain * TORQUE[:300]
    t = 0.01 * np.arange(300)
    together = chosen.blocks(friction, many)
    together.place(0.0, 0.0, force[0])
    all_paths = march(together, t, force[:-1], force[:-1], 40)
    for j in (0, 7, LANES, m - 1):
        alone = chosen.blocks(friction[:, j : j + 1], many[:, j : j + 1])
        alone.place(0.0, 0.0, force[0])
        assert np.array_equal(march(alone, t, force[:-1], force[:-1], 40)[:, :, 0], all_paths[:, :, j])


def test_two_masses_are_refused_where_the_axis_file_gives_one():
    for mechanics in (Mechanics(M=20.0), Mechanics(Orientation.ROTARY, J=0.5, force_per_torque=1.0)):
        for name in ("backlash", "transmission_compliance"):
            with pytest.raises(InputError, match=f"{name} needs inertia on both sides"):
                simulate(Axis("one", mechanics), FRICTION, [0.0], sample_time=0.01, effects={name: EXAMPLES[name]})


def test_an_effect_named_twice_is_refused():
    with pytest.raises(InputError, match="named twice"):
        plan(Surroundings.of(AXIS), ("backlash", "backlash"))


def test_units_of_a_rotary_axis_are_newton_metres_and_radians():
    joint = Axis("joint", Mechanics(Orientation.ROTARY, J=0.5, force_per_torque=1.0))
    units = {p.name: p.unit_on(joint) for name in CATALOGUE for p in find(name).parameters}
    assert units["amplitude"] == "N*m"
    assert units["centre"] == "rad"
    assert units["mass_error"] == "kg*m^2"
    assert units["bristle_damping"] == "N*m*s/rad"
    assert units["delay"] == "s"
