"""plant/ judged by the independent simulator of tests/reference: same equations, other author, other integrator.

The reference is converged to 0.5 µm and mostly to 1e-12 m (tests/reference/test_reference.py). Print the table with
`pytest -s`. Tolerances: 50 µm over 20 s at the sub-steps plant chooses by itself is what issue 3 asks of the paper's
case; forced to 100 sub-steps what is left must be a matter of sub-steps, so 2 µm, or 20 µm where an effect switches
with the motion (first order), never a matter of equations: a wrong reading of an effect shows as millimetres.
"""

from dataclasses import replace

import numpy as np
import pytest

from plant.axis import Axis, Mechanics, Orientation, TorqueHold
from plant.friction import StribeckFriction
from plant.simulation import simulate
from tests.reference.draws import CLOSED_KINDS, OPEN_KINDS, TWO_MASS, Facts, draw_effect, draw_excitation, draw_plant
from tests.reference.examples import EXAMPLES, PAIRS, example, paper_machine, paper_torque
from tests.reference.excitation import Torque
from tests.reference.machine import run
from tests.reference.parameters import EFFECTS, ReferencePlant

OWN_NAMES = {"payload": "weight_share", "both": "static_share"}  # helpers that effects.md does not name
OWN_CHOICE = 50e-6  # m over 20 s, issue 3
FORCED = 2e-6  # m at 100 sub-steps of 10 ms: second order
SWITCHING = 20e-6  # m, first order: dwell resets and impacts
MIDDLE = EXAMPLES["position_dependent_friction"]["middle"]
rows: list[str] = []


@pytest.fixture(scope="module", autouse=True)
def table():
    """Print what was measured, for `-s`."""
    yield
    print(f"\n{'machine':28s}{'effects':52s}{'sub-steps chosen':>18s}{'error':>12s}{'at 100':>12s}")
    print("\n".join(rows))


def plants_answer(machine: ReferencePlant, torque: Torque, middle: float, substeps: int | None = None):
    """Trajectory of plant.simulate for the reference's machine."""
    effects = {
        name: {OWN_NAMES.get(key, key): value for key, value in values.items() if key not in ("middle", "side")}
        for name, values in machine.effects.items()
    }
    for name, key, value in (("dwell_time_stiction", "slip", 1e-3), ("inertia_error", "weight_share", 1.0)):
        if name in effects:
            effects[name].setdefault(key, value)
    m = machine
    mechanics = Mechanics(Orientation(m.orientation), m.M, m.J, m.Rc, None, m.Rm, m.force_per_torque, m.g)
    law = StribeckFriction(m.coulomb_force, m.static_force, m.stribeck_velocity, m.viscous_coefficient)
    hold = TorqueHold.LINEAR if torque.hold == "linear" else TorqueHold.HOLD
    return simulate(
        Axis("judged", mechanics), law, torque.torque, t=torque.t, hold=hold, effects=effects, middle=middle,
        substeps=substeps,
    )  # fmt: skip


def compare(label, machine, torque, middle, forced=100, scale=1.0):
    """Largest position error at plant's own sub-steps and at `forced`, times `scale` (m per unit of position)."""
    truth = run(machine, torque, settled="belt")["position"]
    own, fine = (plants_answer(machine, torque, middle, count) for count in (None, forced))
    errors = [float(np.abs(answer.position - truth).max() * scale) for answer in (own, fine)]
    names = "+".join(machine.effects) or "baseline"
    rows.append(f"{label:28s}{names:52s}{own.substeps:18d}{errors[0] * 1e6:9.2f} um{errors[1] * 1e6:9.2f} um")
    return errors


@pytest.mark.parametrize("hold", ["hold", "linear"])
@pytest.mark.parametrize("reading", ["literal", "bump"])
def test_the_papers_case_agrees(reading, hold):
    machine = paper_machine(reading)
    own, fine = compare(f"{reading} {hold}", machine, paper_torque(machine, hold), 0.0)
    assert own < 10e-6
    assert fine < 0.2e-6


@pytest.mark.parametrize("reading", ["literal", "bump"])
@pytest.mark.parametrize("name", list(EXAMPLES))
def test_every_effect_agrees(reading, name):
    machine = paper_machine(reading, example(name))
    own, fine = compare(reading, machine, paper_torque(machine), MIDDLE)
    assert own < OWN_CHOICE
    # the bump reading stands on the edge of break-away: what is tiny in the literal one is amplified there
    assert fine < (SWITCHING if name == "dwell_time_stiction" or reading == "bump" else FORCED)


@pytest.mark.parametrize("names", PAIRS, ids="+".join)
def test_pairs_agree(names):
    machine = paper_machine("literal", example("+".join(names)))
    own, fine = compare("literal", machine, paper_torque(machine), MIDDLE)
    assert own < OWN_CHOICE
    assert fine < (SWITCHING if "dwell_time_stiction" in names else FORCED)


@pytest.mark.parametrize("other", ["coulomb_asymmetry", "position_dependent_friction"])
def test_a_step_of_the_coulomb_force_is_scaled_with_the_level(other):
    machine = paper_machine("literal", {"step_change": {"step": 15.0, "time": 3.0}, other: EXAMPLES[other]})
    own, fine = compare("literal", machine, paper_torque(machine, duration=6.0), MIDDLE)
    assert own < OWN_CHOICE
    assert fine < FORCED


@pytest.mark.parametrize("hold", ["hold", "linear"])
@pytest.mark.parametrize("name", ["viscous_asymmetry", "dead_time"])
def test_irregular_stamps_agree(name, hold):
    machine = paper_machine("literal", example(name))
    regular = paper_torque(machine)
    keep = np.random.default_rng(4).random(len(regular.t)) > 0.3
    keep[[0, -1]] = True
    torque = Torque(regular.t[keep], regular.torque[keep], hold)
    truth = run(machine, torque)["position"]
    error = np.abs(plants_answer(machine, torque, MIDDLE, 100).position - truth).max()
    # a long interval may see several delayed samples arrive; plant lets one sub-step of it carry their mean
    assert error < (SWITCHING if name == "dead_time" else FORCED)


def drawn(seed: int, count: int):
    """A machine with `count` effects, every parameter drawn, and a torque; closed loops are replayed as torques."""
    rng = np.random.default_rng([31, seed])
    orientation = ("vertical", "horizontal", "rotary")[seed % 3]
    plain = draw_plant(rng, orientation)
    kind = str(rng.choice([kind for kind in OPEN_KINDS + CLOSED_KINDS if kind not in ("square", "staircase")]))
    excitation = draw_excitation(rng, kind, plain, 8.0, 0.01)
    usual = run(plain, excitation)
    facts = Facts.of(usual)
    names = [str(name) for name in rng.permutation(list(EFFECTS)) if not (orientation == "rotary" and name in TWO_MASS)]
    effects = {name: draw_effect(rng, name, plain, facts, 0.5) for name in names[:count]}
    machine = replace(plain, effects=effects)
    if isinstance(excitation, Torque):
        return f"{orientation} {kind}", machine, replace(excitation, hold=str(rng.choice(["hold", "linear"]))), facts
    return f"{orientation} {kind}", machine, Torque(excitation.t, usual["force_command"] / plain.gain), facts


def test_machines_drawn_at_random_with_up_to_three_effects_agree():
    fine_errors, own_errors = [], []
    for seed in range(24):
        label, machine, torque, facts = drawn(seed, 1 + seed % 3)
        scale = 0.2 / facts.half if machine.orientation == "rotary" else 1.0
        forced = max(2, round(200 * (torque.t[1] - torque.t[0]) / 0.01))
        own, fine = compare(label, machine, torque, facts.middle, forced, scale)
        own_errors.append(own)
        fine_errors.append(fine)
    assert np.median(fine_errors) < 0.1e-6
    assert np.mean(np.array(fine_errors) < SWITCHING) >= 0.9  # a near-bistable break-away may multiply a tiny error
    assert np.mean(np.array(own_errors) < OWN_CHOICE) >= 0.9
