"""What no start leads to, or a bound keeps away, can never be named: each of these was, and another name was given."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import diagnosis, explore, select
from identify.mismatch.baseline import fit_baseline
from identify.mismatch.compare import Comparison, Fit, fit
from identify.mismatch.detect import detectable
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.explore import Candidate, _look, shortlist
from identify.mismatch.guise import Guise, Unknown
from identify.mismatch.own_curves import LENGTHS
from identify.mismatch.progress import unheard
from identify.mismatch.result import Verdict
from identify.mismatch.rugged import moved
from identify.mismatch.rules import NO_NAME, _too_damped, _too_hard, _too_lasting, _too_much
from identify.mismatch.score import extend
from identify.mismatch.uncatalogued import uncatalogued
from identify.mismatch.wandering import OTHERS, one_of_many, wanders
from identify.mismatch.ways import guises
from identify.mismatch.ways_memory import compliance
from identify.observer import gain_table
from identify.polish import polish_all
from identify.preprocess import prepare
from identify.search import losses_by_gain
from plant.axis import Axis, Mechanics, Orientation
from plant.axis_file import read_axis
from plant.effects import find
from plant.presets import paper_axis
from plant.recording_files import read_recording_entry
from tests.blind.plan import ATTEMPTS, draw_spec
from tests.identify.small_machine import AXIS, MASS, driven, dry
from tests.identify.test_uncatalogued import setting
from tests.reference.cases import UndrawableError, draw_case, write_case


def diagnosed(folder, seed, index):
    """A case of a blind study that has been read, the largest command [N*m], and the diagnosis."""
    _, spec = draw_spec(seed, index)
    for attempt in range(ATTEMPTS):
        with contextlib.suppress(UndrawableError):
            case = draw_case(replace(spec, seed=spec.seed + attempt))
            axis = read_axis(write_case(case, folder))
            recordings = [read_recording_entry(entry, axis) for entry in axis.recordings]
            largest = max(abs(recording.force).max() for recording in recordings) / abs(axis.mechanics.gain)
            return case, largest, diagnose(recordings, axis)
    raise AssertionError("nothing to diagnose")


def alone_and_as_large(case, found, name, parameter):
    """The true size, after checking that nothing but the effect is named and that its interval holds it."""
    true = case.labels["effects"][name][parameter]
    assert [effect.name for effect in found.effects] == [name]
    low, high = found.effects[0].parameters[parameter].ci95
    assert low < true < high
    return true


def test_an_asymmetry_of_a_viscous_friction_that_the_fit_has_lost(tmp_path):
    """The baseline gives the whole of it to the Stribeck curve: a share of nothing has no slope, its twin has one."""
    case, _, found = diagnosed(tmp_path, 1_240_000, 68)
    assert "viscous_asymmetry" in case.labels["effects"]
    assert ("viscous_asymmetry",) in found.alternatives
    assert ("coulomb_asymmetry",) in found.alternatives


def test_a_torque_limit_far_below_what_a_loop_that_winds_up_asks_for(tmp_path):
    """A limit of a sixth of the largest command was `unexplained`: a fifth was the least that was looked for."""
    case, largest, found = diagnosed(tmp_path, 1_260_000, 5)
    limit = alone_and_as_large(case, found, "torque_saturation", "limit")
    assert limit < 0.2 * largest


def test_an_eccentricity_of_a_joint_that_turns_a_ninth_of_a_turn(tmp_path):
    """Over so little of it, it is a factor on the torque that has a slope: without it, a wrong inertia was named."""
    case, _, found = diagnosed(tmp_path, 1_240_000, 3)
    alone_and_as_large(case, found, "pulley_eccentricity", "relative_eccentricity")


def test_a_soft_transmission_is_among_the_starts():
    """A belt of 1.5 kN/m between 13 and 3 kg was a mass of -6 kg: no start was softer than 10 kN/m."""
    axis = replace(paper_axis(), mechanics=replace(paper_axis().mechanics, M=13.0))
    softest = min(guise.starts[:, 0].min() for guise in compliance(find("transmission_compliance"), setting(axis=axis)))
    assert softest < 3e3


def test_the_transmission_of_a_heavy_machine_may_be_stiffer_and_is_as_damped():
    """One of 9.9 MN/m that swings at 100 Hz was `no_mismatch`, another a wrong mass: 1 MN/m was the stiffest."""

    def looked_for(scale, sample_time=0.002):
        mechanics = replace(paper_axis().mechanics, M=10.0 * scale, J=scale * paper_axis().mechanics.J)
        at = setting(Axis("x", mechanics), mass=mechanics.moving_mass, sample_time=sample_time)
        return compliance(find("transmission_compliance"), at)[0]

    def swings(guise):
        stiffness, damping = guise.starts[:, 0], guise.starts[:, 1]
        return np.sqrt(stiffness / guise.swings) / (2 * np.pi), damping / (2 * np.sqrt(stiffness * guise.swings))

    usual, heavy = looked_for(1.0), looked_for(100.0)
    (hertz, ratio), (slower, alike) = swings(usual), swings(heavy)
    assert heavy.swings == pytest.approx(100.0 * usual.swings)
    assert slower == pytest.approx(hertz)
    assert alike == pytest.approx(ratio)
    fastest = np.sqrt(heavy.unknown("stiffness").high / heavy.swings) / (2 * np.pi)
    assert 140.0 < fastest < 160.0
    assert slower.max() < fastest
    assert heavy.unknown("damping").high > 2.0 * heavy.starts[-1, 1]
    sampled = looked_for(100.0, 0.01)
    assert np.sqrt(sampled.unknown("stiffness").high / sampled.swings) == pytest.approx(np.pi / 0.01)


@pytest.mark.parametrize("known", [True, False])
def test_two_masses_are_looked_for_where_nobody_knows_how_much_they_are_in_all(known):
    """The axis file says how they share it; a gap of 0.3 mm had no name where `inertia_known` was false."""
    mechanics = Mechanics(Orientation.HORIZONTAL, M=126.0, J=0.05692, Rc=0.0516, inertia_known=known)
    at = setting(Axis("x", mechanics), mass=0.8 * mechanics.moving_mass)
    found = guises({name: find(name) for name in ("backlash", "transmission_compliance")}, at)
    assert [guise.name for guise in found] == ["backlash", "transmission_compliance"]
    motor = 0.05692 / 0.0516**2
    assert found[1].swings == pytest.approx(0.8 * motor * 126.0 / (motor + 126.0))
    rigid = setting(Axis("x", replace(mechanics, J=0.0)))
    assert not guises({name: find(name) for name in ("backlash", "transmission_compliance")}, rigid)


@pytest.mark.parametrize(("times", "named"), [(1.1, True), (1.4, False)])
def test_a_limit_that_no_command_comes_near_is_a_motor_that_gives_less(times, named):
    """A motor whose iron saturates gives 84 % of each further newton: the shoulder of a limit of 1.4 times the peak."""
    here = setting()
    soft = next(way for way in guises({"torque_saturation": find("torque_saturation")}, here) if way.size == 2)
    z = np.array(
        [soft.unknowns[0].scaled(times * here.peak / abs(here.axis.mechanics.gain)), soft.unknowns[1].scaled(0.3)]
    )
    assert (soft.oddity(z) is None) is named


@pytest.mark.parametrize(
    ("explains", "after", "answers"), [(True, None, True), (True, "still not known", False), (False, None, False)]
)
def test_a_name_that_stands_may_make_friction_known(monkeypatch, explains, after, answers):
    """A drive that lags by 38 ms hid the friction of a lift from the baseline: 3.9 N, give or take 1, of 20."""
    found = SimpleNamespace(explains=explains, final="with the lag", or_constant=lambda: found)
    reasons = {"baseline": "friction is not known", "with the lag": after}
    stand_ins = {
        "read_torque": lambda *_: (SimpleNamespace(train=None), "baseline"),
        "_too_little": lambda *_: None,
        "_unknown_friction": lambda fitted, _: reasons[fitted],
        "_search": lambda *_: (None, [], SimpleNamespace(steps=[], baseline=None)),
        "Conclusion": lambda *_: found,
        "_insufficient": lambda *given: given[-1],
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    recording = SimpleNamespace(t=np.arange(3.0))
    told = diagnosis._selected([recording], None, None, doubtful=False, seed=0, progress=unheard)
    assert told == (found if answers else "friction is not known")


def bristles(stiffness, damping, rotary=False):
    """Fitted bristles on 10 kg with 20 N of friction (10 kg m^2, 1000 N m), and their guise."""
    unknowns = (
        Unknown("bristle_stiffness", 1e5, 1e2, 1e9, log=True),
        Unknown("bristle_damping", 1e3, 1.0, 1e6, log=True),
    )
    guise = Guise(find("presliding_hysteresis"), unknowns, np.array([[1e5, 1e3]]))
    scales, axis = SimpleNamespace(travel=8.0 if rotary else 0.5, mass=10.0), SimpleNamespace(is_rotary=rotary)
    problem = SimpleNamespace(slot=lambda _: slice(0, 2), scales=scales, axis=axis)
    x = np.array([one.scaled(value) for one, value in zip(unknowns, (stiffness, damping), strict=True)])
    return SimpleNamespace(problem=problem, x=x, dry_level=1000.0 if rotary else 20.0), guise


@pytest.mark.parametrize(
    ("stiffness", "rotary", "named"), [(2e6, False, False), (5e5, False, True), (2e6, True, True), (1e8, True, False)]
)
def test_bristles_that_bend_less_than_any_contact_are_none(stiffness, rotary, named):
    """A drive with 20 N of friction had bristles that bend by 9 um before they slide."""
    fitted, guise = bristles(stiffness, 3e3, rotary)
    usual = Comparison(-200.0, 5.0, -150.0, 0.8, 0.8, 200.0, 5.0, 1.0, 150.0, 0.5)
    assert (_too_hard(fitted, guise, usual) is None) is named
    assert _too_hard(fitted, SimpleNamespace(name="backlash"), usual) is None


@pytest.mark.parametrize(
    ("stiffness", "evidence", "lacking", "unseen", "named"),
    [
        (1.33e6, 22545.0, 0.32, 0.41, True),  # 15 um; rolling contacts bend by as little
        (1.33e6, 22545.0, 0.70, 0.41, False),
        (1.33e6, 22545.0, 0.32, 0.80, False),
        (1.33e6, 500.0, 0.32, 0.41, False),
        (5e6, 22545.0, 0.32, 0.41, False),  # 4 um
    ],
)
def test_bristles_that_bend_by_ten_micrometres_want_overwhelming_evidence(stiffness, evidence, lacking, unseen, named):
    """Five machines of outside authors had bristles of 3 to 16 um; three of them were not to be overlooked."""
    fitted, guise = bristles(stiffness, 3e3, rotary=False)
    told = Comparison(-evidence, 18.0, -0.8 * evidence, 0.5, unseen, evidence, 7.5, 1.0, 0.8 * evidence, lacking)
    assert (_too_hard(fitted, guise, told) is None) is named


@pytest.mark.parametrize(("coulomb", "named"), [(0.3, True), (0.02, True), (0.0, False)])
def test_friction_that_grows_with_the_load_leaves_some_that_does_not(coulomb, named):
    """Viscous friction that differs with the direction (AQ-0046) took a coefficient of 0.57, and F_c was nothing."""
    fitted = SimpleNamespace(x=np.array([coulomb, 0.6, -1.0, 0.4]))
    assert (_too_much(fitted, SimpleNamespace(name="load_dependent_friction")) is None) is named
    assert _too_much(fitted, SimpleNamespace(name="rail_defect")) is None


@pytest.mark.parametrize(("damping", "named"), [(3e3, True), (1.2e4, True), (2e4, False)])
def test_bristles_that_are_damped_as_no_contact_is_are_none(damping, named):
    """An encoder's error had some with 6 times the critical damping, and a ripple beside them."""
    fitted, guise = bristles(5e5, damping)
    assert (_too_damped(fitted, guise) is None) is named
    assert _too_damped(fitted, SimpleNamespace(name="backlash")) is None


def test_an_effect_is_moved_to_where_it_is_likelier():
    """Beside a gap, a step at 6.8 s with 1030 stayed at 8.0 s with 487: each contact between them is a peak."""
    samples = prepare(driven(1, lambda t, y, v: (dry(v, 20.0 - 6.0 * (t > 6.0)), 0.0)), AXIS)
    sizes = dict(lowest=0.0, highest=0.4, duration=20.0, mass=MASS)
    step, _ = guises({"step_change": find("step_change")}, setting(AXIS, **sizes))
    bare = fit_baseline(samples, AXIS, 0)
    problem = bare.problem.including((step,))
    x = np.concatenate([bare.x[: problem.base], np.zeros(step.size), bare.x[problem.base :]])
    moment = problem.slot(step).start + step.place()
    x[moment] = step.unknown("time").scaled(15.0)
    ends = polish_all(problem, x[None], bare.found.gain, pinned=moment)
    stuck = Fit(problem, replace(bare.found, x=ends.x[0], criterion=float(ends.loss[0])))
    found = moved(stuck, step)
    assert step.value(found.x[problem.slot(step)], "time") == pytest.approx(6.0, abs=0.1)
    assert found.found.criterion < stuck.found.criterion - 100.0
    assert moved(found, step) is found


def test_what_was_found_beside_other_effects_begins_there():
    """A warmth that was clear by itself (AR-0053) was not seen beside a ripple: no start led to it."""
    samples = prepare(driven(1, lambda t, y, v: (dry(v, 20.0 - 6.0 * (t > 6.0)), 0.0)), AXIS)
    step, _ = guises({"step_change": find("step_change")}, setting(AXIS, duration=20.0, mass=MASS))
    bare = fit_baseline(samples, AXIS, 0)
    at_six, at_fifteen = (
        np.array([step.unknown("step").scaled(size), step.unknown("time").scaled(time)])
        for size, time in ((-6.0, 6.0), (0.2, 15.0))
    )
    known = fit(*extend(bare, step, at_six[None]))
    afar = Candidate(step, [at_fifteen], [bare.found.gain])
    lost, found = (_look(bare, candidate) for candidate in (afar, replace(afar, known=known)))
    assert found.gained > lost.gained + 100.0
    assert step.value(found.x[found.problem.slot(step)], "time") == pytest.approx(6.0, abs=0.1)
    assert [candidate.known for candidate in shortlist(bare, [step], known={step.way: known})] == [known]


def test_of_what_is_strong_the_likeliest_fit_is_remembered(monkeypatch):
    monkeypatch.setattr(select, "price", lambda fit: fit.price)

    def step(price, evidence, name="torque_ripple", there=True):
        guise = SimpleNamespace(way=(name, ()))
        fitted = SimpleNamespace(price=price, problem=SimpleNamespace(guises=(guise,) if there else ()))
        return SimpleNamespace(fit=fitted, guise=guise, evidence=SimpleNamespace(bic=-evidence))

    steps = [
        step(-10.0, 100.0),
        step(-30.0, 90.0),
        step(-20.0, 200.0),
        step(-40.0, 50.0),
        step(-50.0, 99.0, there=False),
    ]
    search = select.Search([], None, unheard)
    search._remember([*steps, step(-1.0, 70.0, "rail_defect")])
    assert {way[0]: found.price for way, found in search.known.items()} == {"torque_ripple": -30.0, "rail_defect": -1.0}


@pytest.mark.parametrize(("proven", "told"), [(False, True), (True, False)])
def test_a_step_that_unseen_data_prove_is_none_of_many(proven, told):
    """Friction fell at 6 s and rose at 14 s: the second is another moment, unless unseen data have the first, too."""
    levels = lambda t, y, v: (dry(v, 20.0 - 6.0 * (t > 6.0) + 4.0 * (t > 14.0)), 0.0)  # noqa: E731
    samples = prepare(driven(1, levels), AXIS)
    step, _ = guises({"step_change": find("step_change")}, setting(AXIS, duration=20.0, mass=MASS))
    bare = fit_baseline(samples, AXIS, 0)
    problem, x = extend(bare, step, np.array([[step.unknown("step").scaled(-6.0), step.unknown("time").scaled(6.0)]]))
    reason = wanders(fit(problem, x), step, 100.0, 6.0, proven=proven)
    assert (reason is not None and reason.startswith(OTHERS)) is told


@pytest.mark.parametrize(
    ("size", "proven", "sure", "told"),
    [(0.54, False, False, True), (0.54, True, False, False), (0.54, False, True, False), (0.3, True, True, True)],
)
def test_of_a_small_step_all_data_must_be_sure(size, proven, sure, told):
    """An outside author's step of 2.6 % left 5 % of the error on unseen data: more than friction wanders by.

    Another's, beside a spring, left 46 %, with 2530 and 1980.
    """
    samples = prepare(driven(1, lambda t, y, v: (dry(v, 20.0 + size * (t > 6.0)), 0.0)), AXIS)
    step, _ = guises({"step_change": find("step_change")}, setting(AXIS, duration=20.0, mass=MASS))
    start = [[step.unknown("step").scaled(size), step.unknown("time").scaled(6.0)]]
    problem, x = extend(fit_baseline(samples, AXIS, 0), step, np.array(start))
    reason = wanders(fit(problem, x), step, 100.0, size, proven=proven, sure=sure)
    assert (reason is not None and "no more than friction wanders by" in reason) is told


@pytest.mark.parametrize(("freed", "verdict"), [(21.0, Verdict.UNEXPLAINED), (99.0, Verdict.EXPLAINED)])
def test_a_brake_that_frees_itself_where_nothing_is_fitted_is_no_step(freed, verdict):
    """A step of 4.25 N that left 10 % of the error was named; the brake let go before its unseen data ended."""
    drags = lambda t, y, v: (dry(v, 20.0 + 6.0 * (6.0 < t < freed)), 0.0)  # noqa: E731
    found = diagnose([driven(1, drags, 24.0)], AXIS)
    assert found.verdict is verdict
    assert found.location.coordinate == "time"
    last = freed if verdict is Verdict.UNEXPLAINED else found.location.interval[1]
    assert found.location.interval == pytest.approx((6.0, last), abs=0.2)
    assert ("it goes back in data that were not fitted" in found.explanation) is (verdict is Verdict.UNEXPLAINED)


@pytest.mark.parametrize(("share", "told"), [(0.013, True), (0.025, False)])
def test_a_warmth_that_is_a_mood_of_friction_is_none(share, told):
    """A healthy axis had one of 1.3 % of its dry friction, with a fifth of the error left; true ones had more."""
    samples = prepare(driven(1, lambda t, y, v: (dry(v), 0.0), 8.0), AXIS)
    warmth = guises({"thermal_drift": find("thermal_drift")}, setting(AXIS, duration=8.0, mass=MASS))[0]
    bare = fit_baseline(samples, AXIS, 0)
    problem, x = extend(bare, warmth, warmth.starts[:1])
    warm = Fit(problem, replace(bare.found, x=x[0]))
    reason = wanders(warm, warmth, 100.0, share * warm.dry_level, proven=True)
    assert (reason is not None and "no more than friction wanders by" in reason) is told


@pytest.mark.parametrize("wandering", [False, True])
def test_a_torque_constant_that_fades_is_none_of_many_changes(monkeypatch, wandering):
    """Friction that wanders looked like one: where another change is as likely, it is no other physics either."""
    now = [0.0]

    def resists(t: float, _: float, v: float) -> tuple[float, float]:
        now[0] = t
        return dry(v, 20.0 + wandering * (4.0 * (t > 3.0) - 3.0 * (t > 9.0) + 3.0 * (t > 14.0))), 0.0

    def fades(told: float, _: float) -> float:
        return told if wandering else told * (0.85 + 0.15 * np.exp(-now[0] / 6.0))

    samples = prepare(driven(1, resists, delivers=fades), AXIS)
    bare = fit_baseline(samples, AXIS, 0)
    fading = next(
        guise for guise in uncatalogued(setting(AXIS, duration=20.0, mass=MASS)) if guise.name == "fading_torque"
    )
    _, steps = explore.explore(bare, [fading], samples)
    (step,) = [one for one in steps if one.guise.name == fading.name]
    assert step.evidence.bic < -100.0
    monkeypatch.setattr(explore, "refusal", lambda *_: NO_NAME)  # as it is where blocks and unseen data agree
    reason = explore.reason_against(step.fit, fading, step.evidence, step.acting)
    assert (reason.startswith(OTHERS), reason == NO_NAME) == (wandering, not wandering)


@pytest.mark.parametrize(
    ("second", "width", "many"), [(0.0, 0.015, False), (0.9, 0.015, True), (0.0, 0.04, False), (0.0, 0.07, True)]
)
def test_a_faint_place_that_has_others_like_it_or_no_room_for_them_is_none(second, width, many):
    """A guide whose friction varies along the way by some percent is well: a place of 4.6 % had others of 3/4 of it."""
    bump = lambda y, centre: np.exp(-0.5 * ((y - centre) / width) ** 2)  # noqa: E731
    level = lambda y: 1.2 * bump(y, 0.1) + second * 1.2 * bump(y, 0.3)  # noqa: E731
    samples = prepare(driven(1, lambda t, y, v: (dry(v) + level(y), 0.0)), AXIS)
    (defect,) = guises({"rail_defect": find("rail_defect")}, setting(AXIS, lowest=0.0, highest=0.4, mass=MASS))
    bare = fit_baseline(samples, AXIS, 0)
    start = [unknown.scaled(value) for unknown, value in zip(defect.unknowns, (1.2, 0.1, width), strict=True)]
    problem, x = extend(bare, defect, np.array([start]))
    found = fit(problem, x)
    evidence = bare.found.criterion - found.found.criterion
    assert evidence > 100.0
    assert one_of_many(found, evidence) is many


def test_a_size_at_which_the_model_runs_away_hides_nothing():
    """A spring that pushes away by as much as it can: its errors squared are beyond what a number can hold."""
    samples = prepare(driven(1, lambda t, y, v: (dry(v), 0.0)), AXIS)
    (spring,) = guises({"position_spring": find("position_spring")}, setting(AXIS, lowest=0.0, highest=0.4, mass=MASS))
    bare = fit_baseline(samples, AXIS, 0)
    assert detectable(bare, [spring])["position_spring"].force_rms > 0.0
    away = replace(spring, starts=spring.starts * np.array([[-1e4, 1.0]]))
    assert not detectable(bare, [away])


def test_a_first_look_sees_through_the_observer_that_is_likeliest(monkeypatch):
    """A look takes every second gain: of clean axes the seventh was 3000 likelier, and nothing was worth a fit."""
    samples = prepare(driven(1, lambda t, y, v: (dry(v, 20.0 + 4.0 * (y > 0.2)), 0.0)), AXIS)
    ways = guises({"rail_defect": find("rail_defect")}, setting(AXIS, lowest=0.0, highest=0.4, mass=MASS))
    found = fit_baseline(samples, AXIS, 0)
    gain = gain_table(samples.sample_time)[0][:, 7]
    current = Fit(found.problem, replace(found.found, gain=gain))
    asked = []

    def losses(problem, x, gains):
        asked.append(gains)
        return losses_by_gain(problem, x, gains)

    monkeypatch.setattr(explore, "losses_by_gain", losses)
    explore._look(current, shortlist(current, ways)[0])
    assert (asked[-1] == gain[:, None]).all(axis=0).any()


@pytest.mark.parametrize(
    ("slip", "slows", "lasting"),
    [(5e-4, None, False), (5.9e-3, None, True), (0.0168, 0.0, True), (0.0168, 1.0, False), (0.0235, 1.0, True)],
)
def test_contacts_are_broken_after_a_part_of_the_travel(slip, slows, lasting):
    """A brake that opens late was stiction that is gone after 17 mm, with a curve that was free to bend and did not.

    Only contacts that age ever more slowly take several slip lengths.
    """
    found = {"slip": slip, "slows": slows}
    high = 5.83e-3 * (1.0 if slows is None else LENGTHS)
    guise = SimpleNamespace(
        name="dwell_time_stiction", unknowns=[SimpleNamespace(parameter="slip", high=high)],
        shapes=frozenset() if slows is None else frozenset({"slows", "slides"}), value=lambda _, name: found[name],
    )  # fmt: skip
    fitted = SimpleNamespace(x=np.zeros(1), problem=SimpleNamespace(slot=lambda _: slice(0, 1)))
    reason = _too_lasting(fitted, guise)
    assert (reason is not None and "no broken contact" in reason) is lasting
