"""The diagnosis: the same law in simulator and fitter, names that are right, silence where nothing is hidden."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

from identify.criterion import FREE, relative_square, restarted
from identify.mismatch.data import TURNED, Judges, gather
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.inverse import effect_force, unexplained
from identify.mismatch.locate import coordinates
from identify.mismatch.residual import setting_of
from identify.mismatch.result import Verdict
from identify.mismatch.select import TWINS, _try_twins
from identify.mismatch.ways import guises
from identify.observer import gain_table
from identify.preprocess import prepare
from identify.problem import FrictionProblem
from plant.axis_file import read_axis
from plant.effects import CATALOGUE, find
from plant.recording_files import read_recording_entry
from tests.identify.small_machine import AXIS, driven, dry
from tests.identify.studies.promises import answer, spec_of, with_effect
from tests.reference.cases import CaseSpec, draw_case, write_case


def recorded(folder, **spec):
    """Axis and recordings of a case of the independent simulator, as a user would have them."""
    case = draw_case(CaseSpec(**spec))
    axis = read_axis(write_case(case, folder))
    return case, axis, [read_recording_entry(entry, axis) for entry in axis.recordings]


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """A machine with nothing hidden: axis, samples, baseline problem and a plausible point."""
    return plausible(tmp_path_factory.mktemp("quiet"), seed=5001, excitation="multisine", duration=12.0)


def plausible(folder, **spec):
    """Axis, samples, baseline problem and a plausible point of a case of the independent simulator."""
    _, axis, recordings = recorded(folder, **spec)
    samples = prepare(recordings[0], axis)
    problem = ExtendedProblem(samples, axis)
    x = np.zeros(problem.size)
    x[:4] = 0.4, 0.5, -1.5, 0.4
    return axis, samples, problem, x


def ways(problem, x):
    return guises({name: find(name) for name in CATALOGUE}, setting_of(problem, x))


def test_without_effects_the_machine_predicts_what_the_baseline_kernel_predicts(quiet):
    axis, samples, problem, x = quiet
    plain = FrictionProblem(samples, axis)
    problem.substeps = plain.substeps
    gains, _ = gain_table(samples.sample_time)
    for gain in gains.T[[0, 5, -1]]:
        assert problem.errors(x[None], gain) == pytest.approx(plain.errors(x[None], gain), abs=1e-11)


def test_every_effect_of_the_catalogue_has_a_guise_that_changes_the_predictions(quiet):
    _, samples, problem, x = quiet
    gains, _ = gain_table(samples.sample_time)
    without = problem.errors(x[None], gains[:, 3])[:, 0].copy()
    setting = dataclasses.replace(setting_of(problem, x), reverses=True)  # else no gap: the weight keeps it closed
    offered = guises({name: find(name) for name in CATALOGUE}, setting)
    assert {guise.name for guise in offered} >= set(CATALOGUE) - {"force_offset", "dwell_time_stiction"}
    for guise in offered:
        more = problem.including((guise,))
        candidates = np.zeros((len(guise.starts), more.size))
        candidates[:, : problem.base] = x[: problem.base]
        candidates[:, more.slot(guise)] = guise.scaled_starts()
        change = np.abs(more.errors(candidates, gains[:, 3]) - without[:, None]).max()
        assert 1e-9 < change < 1.0, guise.name


def test_what_is_as_large_as_the_catalogue_says_is_not_on_the_bound_of_the_search(quiet):
    """A pulley with an eccentricity of 0.3, told by evidence of 9732, had ended on the bound."""
    _, _, problem, x = quiet
    sizes = {
        "pulley_eccentricity": "relative_eccentricity",
        "load_dependent_friction": "coefficient",
        "torque_scale_error": "relative_error",
        "torque_ripple": "relative_amplitude",
    }
    asked = 0
    for guise in ways(problem, x):
        for unknown in guise.unknowns:
            if sizes.get(guise.name) == unknown.parameter:
                most = next(part.plausible[1] for part in guise.effect.parameters if part.name == unknown.parameter)
                assert unknown.high > 1.2 * most, guise.name
                asked += 1
    assert asked == len(sizes)


def test_scaled_starts_are_inside_the_bounds_and_decode_to_themselves(quiet):
    _, _, problem, x = quiet
    for guise in ways(problem, x):
        low, high = guise.bounds()
        scaled = guise.scaled_starts()
        assert (scaled >= low - 1e-9).all(), guise.name
        assert (scaled <= high + 1e-9).all(), guise.name
        if guise.wave is None:
            names = [p.name for p in guise.effect.parameters]
            rows = [names.index(unknown.parameter) for unknown in guise.unknowns]
            assert guise.values(scaled)[rows] == pytest.approx(guise.starts.T)


def test_the_inverse_model_finds_a_force_that_was_put_in(quiet):
    _, samples, problem, x = quiet
    pushed = dataclasses.replace(samples, force=samples.force + 3.0)
    lacking = unexplained(problem, x, pushed).lacking - unexplained(problem, x, samples).lacking
    moving = np.abs(lacking) > 1.0
    assert np.median(lacking[moving]) == pytest.approx(3.0, abs=0.3)


def test_what_a_slow_filter_makes_of_the_ends_of_a_run_is_left_out(quiet):
    _, samples, problem, x = quiet
    fast, slow = (unexplained(problem, x, samples, cut) for cut in (100.0, 4.0))
    assert fast.index[0] == 10
    assert slow.index[0] == round(2.0 / 4.0 / samples.sample_time)


def test_the_force_of_an_effect_is_in_newtons(quiet):
    _, _, problem, x = quiet
    guise = next(guise for guise in ways(problem, x) if guise.name == "quadratic_drag")
    more = problem.including((guise,))
    y = np.concatenate([x[: problem.p], [0.1], x[problem.p :]])
    drag = guise.values(np.array([[0.1]]))[0, 0]
    speed = np.gradient(problem.samples.position, problem.samples.t)
    assert effect_force(more, y, guise)[0] == pytest.approx(np.sqrt(np.mean((drag * speed**2) ** 2)), rel=0.3)


REMEMBERS = [
    ("actuator_lag", {"time_constant": 0.05}, 100.0),
    ("presliding_hysteresis", {"bristle_stiffness": 3e4, "bristle_damping": 1e3}, 100.0),
    ("transmission_compliance", {"stiffness": 3e4, "damping": 30.0, "hangs": 1.0}, 10.0),
    ("dwell_time_stiction", {"stiction_rise": 30.0, "time_constant": 2.0, "age": 0.0, "slip": 1e-3}, 3.0),
]


@pytest.mark.parametrize(("name", "values", "worse"), REMEMBERS, ids=[name for name, *_ in REMEMBERS])
def test_a_free_run_that_goes_on_remembers_what_was_under_way(quiet, tmp_path, name, values, worse):
    """Where a perfect model is restarted every second, only the noise of its restarts is left."""
    _, samples, problem, x = quiet
    if name == "dwell_time_stiction":  # a motion that rests for longer than a free run
        _, samples, problem, x = plausible(tmp_path, seed=5003, excitation="loop_trapezoid", duration=20.0)
    guise = next(guise for guise in ways(problem, x) if guise.name == name)
    more = problem.including((guise,)).marched(40)
    y = np.zeros(more.size)
    y[: problem.base] = x[: problem.base]
    y[more.slot(guise)] = [unknown.scaled(values[unknown.parameter]) for unknown in guise.unknowns]
    moved = samples.position - more.errors(y[None], FREE)[:, 0]
    perfect = dataclasses.replace(samples, position=moved)
    cut, states = restarted(perfect)
    left = _left(more.on(cut, states), y)
    forgetful = _left(more.on(dataclasses.replace(cut, steps=_ended(cut)), states), y)
    print(f"{name}: {left:.2g}, forgetful {forgetful:.2g}")
    assert left < 1e-5
    assert forgetful > worse * left


def test_stiction_that_slip_alone_wears_off_is_measured(tmp_path):
    """Taken to fall with speed as F_s does, it was known to four fifths only."""
    spec = {"effects": ("dwell_time_stiction",), "shapes": "foreign", "excitation": "loop_trapezoid"}
    case, axis, recordings = recorded(tmp_path, seed=6107, size=1.5, duration=40.0, **spec)
    assert case.labels["shapes"] == {"dwell_time_stiction": "by_slip"}
    (found,) = diagnose(recordings, axis).effects
    assert found.name == "dwell_time_stiction"
    rise = found.parameters["stiction_rise"]
    low, high = rise.ci95
    assert low < case.labels["effects"][found.name]["stiction_rise"] < high
    assert high - low < 0.6 * rise.value


def _left(problem, x):
    """Eq. (4) over the runs of `problem`, each from what an observer knew at its start."""
    gains, _ = gain_table(problem.samples.sample_time)
    start = np.zeros(problem.size)
    start[: problem.p] = x[: problem.p]
    return relative_square(problem.free_runs(start, gains[:, -1]), problem.samples.position)


def _ended(cut):
    """Steps of samples whose runs do not lead to each other."""
    steps = cut.steps.copy()
    steps[np.flatnonzero(np.diff(cut.run))] = 0.0
    return steps


def test_coordinates_say_when_and_where_the_direction_last_changed():
    t = np.arange(600) * 0.01
    position = 0.1 * np.sin(2 * np.pi * 0.5 * t)
    from identify.preprocess import Samples

    samples = Samples(
        t=t,
        force=np.ones(600),
        position=position,
        steps=np.full(600, 0.01),
        run=np.zeros(600, dtype=np.int64),
        valid=np.ones(600, dtype=bool),
        sample_time=0.01,
        linear=False,
    )
    from plant.axis import Axis, Mechanics

    found = coordinates(samples, Axis("a", Mechanics(M=10.0)))
    k = 225  # 2.25 s, 0.75 s after the turn at 1.5 s
    assert found["time_since_reversal"][k] == pytest.approx(0.75, abs=0.03)
    assert found["distance_since_reversal"][k] == pytest.approx(abs(position[k] + 0.1), abs=0.005)


@pytest.mark.parametrize(
    ("effect", "excitation", "seed"),
    [("rail_defect", "loop_scurve", 5100), ("viscous_asymmetry", "sine", 5101), ("actuator_lag", "loop_cycle", 5102)],
)
def test_a_hidden_effect_is_named_and_sized_on_recordings_of_another_simulator(tmp_path, effect, excitation, seed):
    case, axis, recordings = recorded(tmp_path, seed=seed, effects=(effect,), excitation=excitation, size=0.7)
    found = diagnose(recordings, axis)
    assert found.verdict is Verdict.EXPLAINED
    assert effect in {name for names in found.alternatives for name in names}
    named = {one.name: one for one in found.effects}
    if effect in named:
        truth = case.labels["effects"][effect]
        for name, quantity in named[effect].parameters.items():
            if name in truth:
                assert quantity.value == pytest.approx(truth[name], rel=0.15, abs=0.002), name
    assert found.fit["extended"].held_out < 0.7 * found.fit["baseline"].held_out


@pytest.mark.parametrize(("excitation", "seed"), [("multisine", 5201), ("loop_trapezoid", 5202), ("sine", 5203)])
def test_nothing_is_named_where_nothing_is_hidden(tmp_path, excitation, seed):
    _, axis, recordings = recorded(tmp_path, seed=seed, excitation=excitation)
    found = diagnose(recordings, axis)
    assert found.effects == ()
    assert found.verdict is Verdict.NO_MISMATCH
    if excitation != "multisine":  # it passes most places too seldom for a surely named defect
        assert found.detectable["rail_defect"].value < 100.0
    allowed = 0.01 * axis.drive.rated_force
    assert found.detectable["force_offset"].value > allowed  # less is what the axis file leaves open


def test_a_constant_force_is_not_promised_where_the_baseline_has_it_free(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=9968, excitation="multisine", orientation="horizontal")
    found = diagnose(recordings, axis)
    assert found.verdict is Verdict.NO_MISMATCH
    assert "viscous_asymmetry" in found.detectable
    assert "force_offset" not in found.detectable


def test_what_is_as_large_as_promised_is_named():
    machine = spec_of(9952)
    promised = answer(machine).detectable
    wanted = ("viscous_asymmetry", "rail_defect", "pulley_eccentricity", "load_dependent_friction")
    rows = [with_effect(machine, name, promised[name].value) for name in wanted]
    assert sum(bool(row and row["named"]) for row in rows) >= 3, rows  # `make promises` for the rate


def test_a_machine_that_hardly_moves_is_insufficient_data(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5301, excitation="still", duration=12.0)
    found = diagnose(recordings, axis)
    assert found.verdict is Verdict.INSUFFICIENT_DATA
    assert found.reason


def test_samples_that_cannot_be_used_are_insufficient_data_too(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5001, excitation="multisine", duration=12.0)
    broken = dataclasses.replace(
        recordings[0], position=np.where(recordings[0].t > 5.0, np.nan, recordings[0].position)
    )
    found = diagnose([broken], axis)
    assert found.verdict is Verdict.INSUFFICIENT_DATA
    assert "not finite" in found.reason


def test_one_recording_is_split_in_time_and_two_by_recording(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5001, excitation="multisine", duration=12.0)
    assert gather(recordings[:1], axis).kind == "time"
    both = gather(recordings, axis)
    assert both.kind == "recording"
    assert len(both.held_out) == pytest.approx(len(recordings[1]), abs=5)
    turned = gather(recordings, axis, Judges.OTHERS)
    assert turned.kind == "recording"
    assert turned.removed == (*both.removed, TURNED)
    np.testing.assert_array_equal(turned.train.position, both.held_out.position)
    np.testing.assert_array_equal(turned.held_out.position, both.train.position)


def test_in_time_only_the_part_of_the_last_recording_that_moves_more_is_held_out(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5001, excitation="multisine", duration=12.0)
    first, last = recordings
    parked = dataclasses.replace(last, position=np.where(last.t > 6.0, last.position[600], last.position))
    for recording, moving in ((last, 7.2), (parked, 0.0)):
        found = gather([first, recording], axis, Judges.PART)
        assert found.kind == "time"
        assert float(found.held_out.t[0]) == pytest.approx(moving, abs=0.1)
        assert len(found.train) + len(found.held_out) == pytest.approx(len(first) + len(last), abs=10)


def test_the_json_has_every_entry_of_the_contract(tmp_path):
    _, axis, recordings = recorded(tmp_path, seed=5001, excitation="multisine", duration=12.0)
    entries = diagnose(recordings, axis).to_dict()
    contract = {
        "verdict", "effects", "alternatives", "location", "fit", "force_error", "held_out_kind", "run_length",
        "remaining_force", "detectable", "changes", "next_experiment", "explanation", "schema_version",
    }  # fmt: skip
    assert contract <= set(entries)


@pytest.mark.parametrize(("pull", "told"), [(1.5, True), (-1.5, True), (0.2, False)])
def test_a_constant_force_that_the_baseline_may_have_is_told(pull, told):
    """A cable that pulls one way, a tilt, an asymmetry: the axis slides on all of them alike."""
    found = diagnose([driven(5, lambda _, __, v: (dry(v), pull), 12.0)], AXIS)
    assert found.verdict is Verdict.NO_MISMATCH
    said = re.search(r"constant force of (\S+) N \(95 %: ± (\S+)\), 8 % of the dry friction", found.explanation)
    assert bool(said) is told
    if told:
        value, half = map(float, said.groups())
        assert abs(value - pull) < half < 0.2


def test_a_twin_that_the_model_already_has_for_its_clocks_is_not_fitted_again():
    """AX-0007: a transmission beside clocks that are apart had a second dead time, without a prior."""
    last = SimpleNamespace(guise=SimpleNamespace(name="transmission_compliance"))
    tried = [SimpleNamespace(guise=SimpleNamespace(name=name)) for name in TWINS["transmission_compliance"]]
    rivals = [[step for step in tried if step.guise.name != "dead_time"]]
    chosen = SimpleNamespace(names=("dead_time", "transmission_compliance"))
    nobody = SimpleNamespace(names={"dead_time"})  # cannot explore
    _try_twins(SimpleNamespace(steps=[last], rivals=rivals, chosen=chosen), nobody)
