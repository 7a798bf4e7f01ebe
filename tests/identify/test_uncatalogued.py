"""Physics outside the catalogue competes with names: it takes them away, and says where to look."""

import contextlib
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import locate, select
from identify.mismatch.compare import Comparison
from identify.mismatch.curve import CURVE
from identify.mismatch.diagnosis import diagnose
from identify.mismatch.guise import NO_FINDING, Setting
from identify.mismatch.remains import Remains
from identify.mismatch.rules import NO_NAME, Step, best_of
from identify.mismatch.uncatalogued import EFFECTS, uncatalogued
from identify.mismatch.words import STRANGE
from plant.axis import Axis, Drive, Mechanics, Orientation, Sensor
from plant.axis_file import read_axis
from plant.effects import names
from plant.presets import paper_axis
from plant.recording_files import read_recording_entry
from tests.identify.small_machine import AXIS, MASS, STEP, driven, dry
from tests.reference.cases import CaseSpec, draw_case, write_case
from tests.second.cases import CaseSpec as SecondSpec
from tests.second.cases import UndrawableError
from tests.second.cases import draw_case as draw_second
from tests.second.cases import write_case as write_second

TRAIN_SEED = 5700


def setting(axis=None, **other):
    sizes = dict(force=50.0, speed=0.2, travel=0.4, mass=10.0, lowest=0.0, highest=0.4, peak=90.0, duration=30.0)
    rest = dict(sample_time=0.01, rests=0.0, spots=(), periods=(0.031,), free_offset=False)
    return Setting(axis or paper_axis(), **(sizes | rest | other))


@pytest.mark.parametrize(
    ("outside", "excitation", "coordinate", "like"),
    [
        ("frictional_lag", "multisine", "velocity", "sees the speed late"),
        ("cable_hysteresis", "two_squares", "distance_since_reversal", "cable chain"),
        ("level_ripple", "loop_sine", "position", "rises and falls along the travel"),
    ],
)
def test_another_simulators_physics_outside_the_catalogue_is_recognised(
    tmp_path, outside, excitation, coordinate, like
):
    case = draw_case(CaseSpec(TRAIN_SEED, outside=outside, excitation=excitation, size=1.2, noise=1e-5, duration=10.0))
    axis = read_axis(write_case(case, tmp_path))
    found = diagnose([read_recording_entry(entry, axis) for entry in axis.recordings], axis)
    assert found.verdict.value == "unexplained"
    assert found.effects == ()
    assert found.location.coordinate == coordinate
    assert like in found.explanation


@pytest.mark.parametrize("seed", [7001, 7004])
def test_a_load_that_swings_is_found_with_its_frequency(tmp_path, seed):
    """A pendulum below a machine of the second simulator was a ripple, a wrong mass, or a force along the torque."""
    case = pendulum(seed)
    truth = case.labels["outside"]["parameters"]
    axis = read_axis(write_second(case, tmp_path))
    found = diagnose([read_recording_entry(entry, axis) for entry in axis.recordings], axis)
    assert found.verdict.value == "unexplained"
    assert found.location.coordinate == "frequency"
    low, high = found.location.interval
    assert low < truth["frequency"] < high
    assert "swings or sways" in found.explanation


def pendulum(seed):
    """A machine of the second simulator from which part of the load hangs."""
    for attempt in range(30):
        with contextlib.suppress(UndrawableError):
            return draw_second(np.random.default_rng([seed, attempt]), SecondSpec("outside", ("pendulum",)))
    raise AssertionError("nothing to diagnose")


def test_what_pulls_in_one_direction_only_is_neither_a_spring_nor_friction_that_grows():
    """Both of them together were named; what they have in common is that one of two directions feels nothing."""
    found = diagnose([driven(seed, hose) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained"
    assert found.location.coordinate == "position"
    assert found.location.interval[0] == pytest.approx(0.1, abs=0.02)
    assert "in one direction of motion only" in found.explanation


def test_a_pull_does_not_begin_where_a_stop_would():
    """A bumper that gives back less than it takes was no end stop any more (case 45 of seed 1280000)."""
    pulls = [guise for guise in uncatalogued(setting()) if guise.name == "one_way_pull"]
    assert {tuple(value for _, value in guise.fixed) for guise in pulls} == {(1, 1), (1, -1), (-1, 1), (-1, -1)}
    for guise in pulls:
        begin = guise.unknowns[1]
        left = 0.4 - begin.high if dict(guise.fixed)["side"] > 0 else begin.low
        assert left == pytest.approx(0.3 * 0.4)
        assert begin.low <= guise.starts[:, 1].min()
        assert guise.starts[:, 1].max() <= begin.high


def hose(_, y, v):
    """120 N/m beyond 0.1 m, on the way up."""
    return dry(v) + (120.0 * max(y - 0.1, 0.0) if v > 0.0 else 0.0), 0.0


class Chain:
    """A spring of 60 N/m that hangs behind a free travel of 60 mm."""

    def __init__(self):
        self.held = 0.2

    def __call__(self, _, y, v):
        self.held = min(max(self.held, y - 0.03), y + 0.03)
        return dry(v), 60.0 * (self.held - 0.2)


def floats(_, y, v):
    """Dry friction that is 5 N less above 0.15 m/s."""
    return dry(v, 20.0 - 5.0 * (abs(v) > 0.15)), 0.0


class Film:
    """Dry friction that a second of motion at 0.4 m/s takes 3 N from."""

    def __init__(self):
        self.lately = 0.0

    def __call__(self, _, y, v):
        self.lately += STEP * (abs(v) - self.lately) / 1.5
        return dry(v, 20.0 - 20.0 * self.lately), 0.0


class Lip:
    """Dry friction that each reversal raises by 8 N, worn off after 20 mm."""

    def __init__(self):
        self.left, self.before = 0.0, 0.0

    def __call__(self, _, y, v):
        way = float(np.sign(v)) or self.before
        self.left = 1.0 if way * self.before < 0.0 else self.left * np.exp(-STEP * abs(v) / 0.02)
        self.before = way
        return dry(v, 20.0 + 8.0 * self.left), 0.0


def grease(_, y, v):
    """Viscous friction that doubles and more towards the far end."""
    return dry(v) + 160.0 * y**2 * abs(v), 0.0


class Grease:
    """Viscous friction that a rest of some 0.2 s raises by 25 N s/m, worked off over 60 mm."""

    def __init__(self):
        self.stiff = 0.0

    def __call__(self, _, y, v):
        at_rest = self.stiff + (1.0 - self.stiff) * STEP / 0.2
        self.stiff = self.stiff * np.exp(-STEP * abs(v) / 0.06) if v else at_rest
        return dry(v) + 25.0 * self.stiff * abs(v), 0.0


def snaps(_, y, v):
    """A magnet that pulls to 0.2 m from both sides, with 4 N at most."""
    away = (y - 0.2) / 0.02
    return dry(v), 4.0 * away * np.exp(0.5 - 0.5 * away**2)


def hums(_, y, v):
    """Dry friction that is 4 N more around 0.2 m/s."""
    return dry(v, 20.0 + 4.0 * np.exp(-0.5 * ((abs(v) - 0.2) / 0.02) ** 2)), 0.0


def brakes(_, y, v):
    """A centrifugal brake: 60 N for every m/s beyond 0.2 m/s."""
    return dry(v) + 60.0 * max(abs(v) - 0.2, 0.0), 0.0


@pytest.mark.parametrize(
    ("physics", "coordinates", "like"),
    [
        (Chain, {"position"}, "behind a free travel"),
        (Film, {"velocity"}, "remembers how fast"),
        (lambda: grease, {"position"}, "changes along the travel"),
        (lambda: floats, {"velocity"}, "another above some speed"),
        (Lip, {"distance_since_reversal"}, "each reversal raises"),
        (Grease, {"dwell_time"}, "a rest raises"),
        (lambda: snaps, {"position"}, "a pull to one place from both sides"),
        (lambda: hums, {"velocity"}, "in a band of speeds"),
        (lambda: brakes, {"velocity"}, "begins above some speed"),
    ],
)
def test_what_remembers_or_changes_along_the_travel_is_recognised(physics, coordinates, like):
    """A spring behind a play was a spring, a governor a drag that grows with the square of the speed."""
    found = diagnose([driven(seed, physics()) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate in coordinates
    assert like in found.explanation


class Ramp:
    """A drive whose force changes by no more than 600 N/s."""

    def __init__(self):
        self.force = 0.0

    def __call__(self, told, _):
        self.force += np.clip(told - self.force, -600.0 * STEP, 600.0 * STEP)
        return self.force


GEARED = dataclasses.replace(AXIS, mechanics=dataclasses.replace(AXIS.mechanics, Rm=0.02))


def weak_pole(told, y):
    """15 % less around 1 rad of each turn of the motor."""
    away = (y / GEARED.mechanics.Rm - 1.0 + np.pi) % (2 * np.pi) - np.pi
    return told * (1.0 - 0.15 * np.exp(-0.5 * (away / 0.5) ** 2))


def test_a_pole_that_lost_its_magnetism_is_found_with_its_sector():
    """It was a wheel out of true with a ripple."""
    found = diagnose([driven(seed, lambda t, y, v: (dry(v), 0.0), delivers=weak_pole) for seed in (1, 2)], GEARED)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "motor_angle"
    low, high = found.location.interval
    assert -0.6 < low < 0.4 < 1.6 < high < 2.6
    assert "one sector of each turn of the motor" in found.explanation


class Weak:
    """A drive that loses 9 % of its force at 0.3 m/s."""

    def __init__(self):
        self.before = None

    def __call__(self, told, y):
        speed = 0.0 if self.before is None else abs(y - self.before) / STEP
        self.before = y
        return told * (1.0 - 0.3 * speed)


class Hasty:
    """A drive that gives half more than it is told, for a tenth of a second."""

    def __init__(self):
        self.late = 0.0

    def __call__(self, told, _):
        self.late += STEP * (told - self.late) / 0.1
        return told + 0.5 * (told - self.late)


@pytest.mark.parametrize(
    ("delivers", "coordinate", "like"),
    [
        (
            lambda: lambda told, _: told * (1.0 + 0.08 * np.sign(told)),
            "torque",
            "for positive than for negative torque",
        ),
        (Weak, "velocity", "falls with speed"),
        (lambda: lambda told, _: told - np.clip(told, -4.0, 4.0), "torque", "dead band"),
        (Ramp, "torque_rate", "no faster than"),
        (lambda: lambda told, _: told * (1.0 - 0.12 * (told / 100.0) ** 2), "torque", "iron that saturates"),
        (
            lambda: lambda told, _: told * (1.0 - 0.25 * (told / 40.0) ** 2 / (1.0 + (told / 40.0) ** 2)),
            "torque",
            "iron that saturates",
        ),
        (lambda: lambda told, y: told * (1.0 + 0.4 * (y - 0.2)), "position", "a transmission that changes"),
        (Hasty, "torque_rate", "overshoots"),
    ],
    ids=["uneven", "weak", "dead band", "ramp", "saturates", "levels off", "lever", "hasty"],
)
def test_a_drive_that_delivers_something_else_is_no_friction(delivers, coordinate, like):
    """A lever was friction that grows along the travel; a ramp was a lag with a wrong mass; iron that saturates was a
    drag while accelerating."""
    found = diagnose([driven(seed, lambda t, y, v: (dry(v), 0.0), delivers=delivers()) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == coordinate
    assert like in found.explanation


class Tilts:
    """A carriage that an overhung mass presses on its guide: 1.5 N for every m/s^2."""

    def __init__(self):
        self.before = 0.0

    def __call__(self, _, y, v):
        faster, self.before = (v - self.before) / STEP, v
        return dry(v) + 1.5 * min(abs(faster), 20.0), 0.0


def test_friction_that_acceleration_raises_does_not_depend_on_the_torque():
    found = diagnose([driven(seed, Tilts()) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "acceleration"
    assert "grows with acceleration" in found.explanation


ARM = Mechanics(orientation=Orientation.ROTARY, M=0.0, J=1e-2 * MASS, Rc=1.0, force_per_torque=1.0)
JOINT = Axis("joint", ARM, Drive(rated_force=20.0), Sensor(position_resolution=1e-5))


def turned(seed, resists):
    """The same machine behind a lever of 0.1 m: 4 rad of travel."""
    one = driven(seed, resists)
    return dataclasses.replace(one, position=10.0 * one.position, force=0.1 * one.force)


def test_the_weight_of_an_arm_is_no_spring():
    """Over four radians it pulls with the sine of its angle."""
    found = diagnose([turned(seed, lambda t, y, v: (dry(v), 6.0 * np.sin(10.0 * y - 0.7))) for seed in (1, 2)], JOINT)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "position"
    assert "a weight that turns with the axis" in found.explanation


@pytest.mark.parametrize(
    ("carries", "pushes", "coordinate", "like"),
    [
        (lambda t, y, v: 3.0 * (v > 0.0), 0.0, "acceleration", "in one direction only"),
        (lambda t, y, v: 3.0 * (y > 0.25), 0.0, "position", "beyond one place only"),
        (lambda t, y, v: 2.0 * (t > 9.0), 0.0, "time", "from one moment on"),
        (lambda t, y, v: 4.0 * (y - 0.2) / 0.4, 5.0, "position", "a moving mass that changes along the travel"),
    ],
    ids=["one way", "beyond a place", "later", "linkage"],
)
def test_mass_that_is_not_always_there_is_no_wrong_mass(carries, pushes, coordinate, like):
    """It was a wrong mass, with friction that grows along the travel, or a force along the torque.

    A mass that changes along the travel `pushes` with the square of the speed.
    """
    recordings = [driven(seed, lambda t, y, v: (dry(v), pushes * v * v), carries=carries) for seed in (1, 2)]
    found = diagnose(recordings, AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == coordinate
    assert like in found.explanation


class Loose:
    """3 kg that lie on the carriage and slip where more than 4 N would be needed."""

    def __init__(self):
        self.speed = 0.0

    def __call__(self, _, y, v):
        pull = float(np.clip(3.0 * (v - self.speed) / STEP, -4.0, 4.0))
        self.speed += STEP * pull / 3.0
        return dry(v), pull


class Oil:
    """2 kg of oil that the carriage drags along within 0.15 s."""

    def __init__(self):
        self.speed = 0.0

    def __call__(self, _, y, v):
        pull = 2.0 * (v - self.speed) / 0.15
        self.speed += STEP * pull / 2.0
        return dry(v), pull


@pytest.mark.parametrize(("load", "like"), [(Loose, "lies loose"), (Oil, "dragged along late")])
def test_a_load_that_does_not_come_along_at_once_is_no_friction_under_load(load, like):
    """What slips was friction under load with a wrong mass."""
    found = diagnose([driven(seed, load()) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "acceleration"
    assert like in found.explanation


class LateBrake:
    """A holding brake that opens 0.3 s after the motion begins, where the axis has rested for 0.1 s: 12 N at first."""

    def __init__(self):
        self.rested, self.moved = 0.0, 9.0

    def __call__(self, _, __, v):
        self.rested = self.rested + STEP if v == 0.0 else 0.0
        self.moved = self.moved + STEP if self.rested < 0.1 else 0.0
        return dry(v) + (12.0 * max(1.0 - self.moved / 0.3, 0.0) if v else 0.0), 0.0


def test_a_brake_that_opens_late_is_no_torque_that_is_clipped():
    """It was that, and stiction that grows at rest."""
    found = diagnose([driven(seed, LateBrake(), 10.0) for seed in (3, 4)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "dwell_time"
    assert "a brake that opens late" in found.explanation


def test_viscous_friction_that_changes_at_one_moment_is_no_warmth():
    found = diagnose(
        [driven(seed, lambda t, _, v: (dry(v) + 10.0 * abs(v) * (t > 10.0), 0.0)) for seed in (3, 4)], AXIS
    )
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "time"
    assert found.location.interval[0] == pytest.approx(10.0, abs=0.1)


def test_springs_that_hold_the_middle_are_no_spring():
    """Two preloaded springs: another author's were a spring, given another exponent of eq. (1) beside it."""
    found = diagnose([driven(s, lambda _, y, v: (dry(v), 3.0 * np.tanh((y - 0.2) / 0.02))) for s in (3, 4)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "position"


def test_beside_what_is_no_effect_a_name_competes_on_equal_terms(monkeypatch):
    """What keeps a name from being given has another exponent, or a shift of the clocks, beside it, too."""
    spring, weight = (
        SimpleNamespace(name=name, depends=depends) for name, depends in (("spring", None), ("weight", "position"))
    )
    asked = []

    class Offered:
        @staticmethod
        def explore(rest, names, *_):
            asked.append((rest, names))
            return rest, tried

    def selected(aside, more=()):
        opening = [SimpleNamespace(guise=weight, refused=NO_NAME), SimpleNamespace(guise=spring, refused=None)]
        steps = [SimpleNamespace(guise=spring), *more]
        return SimpleNamespace(opening=opening, steps=steps, aside=aside, chosen="both")

    monkeypatch.setattr(select, "without", lambda fitted, guise: f"{fitted} without {guise.name}")
    monkeypatch.setattr(select, "best_of", lambda steps: steps[0] if steps else None)
    tried = []
    assert select._odder_beside(selected({CURVE}), Offered)
    tried = ["spring"]
    assert not select._odder_beside(selected({CURVE}), Offered)
    assert asked == [("both without spring", {"spring", "weight"})] * 2
    assert not select._odder_beside(selected(set()), Offered)
    assert not select._odder_beside(selected({CURVE}, [SimpleNamespace(guise=weight)]), Offered)


def test_a_fan_that_brakes_one_way_is_no_viscous_friction():
    """Viscous friction that differs with the direction left 2 % of the error; the square of the speed leaves less."""
    found = diagnose([driven(seed, lambda t, y, v: (dry(v) + 40.0 * v * v * (v > 0.0), 0.0)) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "velocity"
    assert "differs with the direction, but with the power" in found.explanation


@pytest.mark.parametrize(("friction", "force"), [(0.05, 0.0), (0.0, 1.0)])
def test_dry_friction_that_pulsates_is_told_from_an_outer_tone(friction, force):
    """Pulses of oil of three outside authors were no mismatch: only forces that do not turn with the motion were."""

    def resists(t: float, _: float, v: float) -> tuple[float, float]:
        tone = np.sin(2.0 * np.pi * 1.3 * t)
        return dry(v, 20.0 * (1.0 + friction * tone)), force * tone

    found = diagnose([driven(seed, resists) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "frequency"
    low, high = found.location.interval
    assert low < 1.3 < high
    assert ("rises and falls in time" in found.explanation) is bool(friction)


@pytest.mark.parametrize("force", [8.0, -8.0])
def test_a_weight_that_is_carried_along_is_found_with_its_side(force):
    """Which side is the loaded one, the constant force tells; it was a shape along the other one, or an event."""
    found = diagnose([driven(seed, lambda t, y, v: (dry(v), force * (y > 0.25))) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "position"
    low, high = found.location.interval
    assert low == pytest.approx(0.25, abs=0.01)
    assert high > 0.3
    assert "sets in beyond one place" in found.explanation
    below = diagnose([driven(seed, lambda t, y, v: (dry(v), force * (y < 0.15))) for seed in (1, 2)], AXIS)
    assert below.location.interval[1] == pytest.approx(0.15, abs=0.01)


def test_friction_that_rises_with_speed_is_no_stribeck_curve():
    """Eq. (1) imitates it with F_s far below F_c: everything was complete."""
    thins = lambda t, y, v: (25.0 - 15.0 * np.exp(-abs(v) / 0.1), 0.0)  # noqa: E731
    found = diagnose([driven(seed, thins) for seed in (1, 2)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "velocity"
    assert "no friction of eq. (1)" in found.explanation


def test_friction_that_is_higher_for_half_a_minute_is_found_with_its_time():
    """So little for so long was friction that wanders."""
    found = diagnose([driven(3, lambda t, y, v: (dry(v, 20.0 + 0.8 * (16.0 < t < 36.0)), 0.0), seconds=50.0)], AXIS)
    assert found.verdict.value == "unexplained", found.effects
    assert found.location.coordinate == "time"
    assert found.location.interval == pytest.approx((16.0, 36.0), abs=2.0)


def tried(*named):
    """Every way on a linear and on a rotary axis."""
    return uncatalogued(setting(rests=1.0), named) + uncatalogued(setting(JOINT), named)


def test_nothing_of_it_may_be_named_and_all_of_it_has_words():
    strange = tried()
    assert {guise.name for guise in strange} == {effect.name for effect in EFFECTS} == set(STRANGE)
    assert not {guise.name for guise in strange} & set(names())
    assert all(guise.depends is not None for guise in strange)


def test_a_plug_in_gives_it_a_name():
    without = {guise.name for guise in tried("frictional_lag")}
    assert without == {effect.name for effect in EFFECTS} - {"frictional_lag"}


def test_starts_lie_within_bounds():
    for guise in tried():
        low, high = guise.bounds()
        starts = guise.scaled_starts()
        assert np.isfinite(starts).all()
        assert ((starts > low) & (starts < high)).all(), guise.name


def test_a_name_gives_way_to_what_is_clearly_likelier_only(monkeypatch):
    monkeypatch.setattr("identify.mismatch.rules.cost", lambda fit: fit)

    def step(name, price, refused=None, unseen=0.5):
        told = Comparison(price, 8.0, price, 0.5, unseen, 100.0, 5.0)
        return Step(price, SimpleNamespace(name=name), told, 1.0, refused, 1.0)

    mass = step("inertia_error", -300.0)
    assert best_of([mass, step("frictional_lag", -340.0, NO_NAME)]) is None
    assert best_of([mass, step("frictional_lag", -310.0, NO_NAME)]) is mass

    proven = step("position_spring", -300.0, unseen=0.04)
    assert best_of([proven, step("cable_hysteresis", -340.0, NO_NAME, unseen=0.02)]) is proven
    assert best_of([proven, step("cable_hysteresis", -340.0, NO_NAME, unseen=0.002)]) is None
    assert best_of([proven, step("cable_hysteresis", -310.0, NO_NAME, unseen=0.002)]) is proven


@pytest.mark.parametrize(
    ("evidence", "unseen", "foreseen", "lacking", "told"),
    [
        (-300.0, 0.5, 10.0, 1.0, True),
        (-300.0, 0.9, 100.0, 0.9, True),
        (-300.0, 0.9, 100.0, 1.0, False),  # it takes nothing
        (-43.0, 0.13, 2285.0, 1.0, True),
        (-47.0, 0.98, 74.0, 0.9, False),  # a healthy machine on rough friction
        (-300.0, 0.9, 10.0, 0.9, False),
    ],
)
def test_it_must_be_told_in_two_of_three_ways(monkeypatch, evidence, unseen, foreseen, lacking, told):
    monkeypatch.setattr(locate, "coordinates", lambda *_: {"velocity": np.linspace(-1.0, 1.0, 1001)})
    seen = Comparison(evidence, 3.0, evidence, 0.9, unseen, foreseen, 4.0, lacking=lacking)
    guise = SimpleNamespace(name="frictional_lag", depends="velocity")
    step = Step(SimpleNamespace(dry_level=10.0), guise, seen, 1.0, NO_NAME, 1.0)
    remains = Remains(None, SimpleNamespace(train=None), None, None, None)
    assert [(one.coordinate, one.like) for one in remains._strange([step])] == told * [("velocity", "frictional_lag")]
    guise.name = CURVE
    assert remains._strange([step]) == [], "another Stribeck exponent is no mismatch"


@pytest.mark.parametrize(
    ("evidence", "slight", "told"),
    [(-291.0, "inertia_error", False), (-400.0, "inertia_error", True), (-291.0, "dead_time", True)],
)
def test_what_explains_hardly_more_than_a_mass_within_the_data_sheet_is_no_finding(monkeypatch, evidence, slight, told):
    """Healthy machines of an author: a mass 1 % too small was none, and a drive that overshoots took its place.

    A counterbalance that leaks stays, though half a millisecond between the clocks explains more: that is beside it.
    """
    monkeypatch.setattr(locate, "coordinates", lambda *_: {"torque_rate": np.linspace(-1.0, 1.0, 1001)})
    seen = Comparison(evidence, 6.8, -221.0, 0.9, 0.6, 147.0, 4.0, lacking=0.9)
    strange = Step(None, SimpleNamespace(name="overshooting_drive", depends="torque_rate"), seen, 1.0, NO_NAME, 1.0)
    why = f"its size of -0.0018 is below 0.0026: {NO_FINDING}"
    heavy = dataclasses.replace(strange, guise=SimpleNamespace(name=slight, depends=None), refused=why)
    mass = dataclasses.replace(heavy, evidence=dataclasses.replace(seen, bic=-305.0, unseen=0.887))
    remains = Remains(None, SimpleNamespace(train=None), None, None, None)
    assert [one.coordinate for one in remains._strange([strange, mass])] == ["torque_rate"] * told
    beside = remains._strange([strange, mass], lambda step: step is not mass)
    assert [one.coordinate for one in beside] == ["torque_rate"] * told
