import dataclasses

import numpy as np
import pytest

from identify.identification import identify_friction
from identify.paper_method import PaperProblem, filter_and_centre, identify_as_in_the_paper, to_unknowns
from identify.preprocess import prepare
from plant.presets import paper_axis, paper_friction, paper_torque
from plant.recording import Recording
from plant.simulation import simulate


def recording(reading="paper-literal", samples=1500, noise=0.0, seed=0):
    axis, friction = paper_axis(reading), paper_friction(reading)
    torque = paper_torque(axis, samples=samples)
    motion = simulate(axis, friction, torque, substeps=10)
    position = motion.position + noise * np.random.default_rng(seed).normal(size=samples)
    return axis, friction, Recording(motion.t, axis.mechanics.gain * torque, position, sample_time=0.01)


def test_the_same_seed_gives_the_papers_answer_bit_by_bit():
    axis, _, data = recording()
    first, second = (identify_friction(data, axis, seed=4, method="paper").to_dict() for _ in range(2))
    assert first == second
    assert first != identify_friction(data, axis, seed=5, method="paper").to_dict()


def test_on_its_own_case_it_errs_like_the_paper_and_gives_no_intervals():
    axis, friction, data = recording()
    law = friction.as_array
    errors = []
    for seed in range(6):
        result = identify_as_in_the_paper(data, axis, seed=seed, bounds=(0.5 * law, 1.5 * law), preprocess=False)
        values = np.array([parameter.value for parameter in result.parameters.values()])
        errors.append(np.abs(values / law - 1))
        assert result.criterion < 5e-5
        assert all(parameter.ci95 is None for parameter in result.parameters.values())
    assert np.all(np.median(errors, axis=0) < (0.15, 0.15, 0.5, 0.2))
    assert np.median(errors, axis=0).max() > 0.01  # its accuracy is the floor, not the goal


def test_centring_takes_gravity_away_and_the_filter_takes_what_is_fast():
    axis, _, data = recording(noise=1e-3)
    raw = prepare(data, axis)
    smooth = filter_and_centre(raw)
    assert smooth.force.mean() == pytest.approx(0.0, abs=1e-9)
    assert smooth.position.mean() == pytest.approx(0.0, abs=1e-12)
    fast = np.fft.rfftfreq(len(raw), 0.01) > 5.0
    power = [np.abs(np.fft.rfft(one.position - one.position.mean()))[fast].sum() for one in (raw, smooth)]
    assert power[1] < 0.05 * power[0]


def test_only_the_longest_run_between_gaps_is_used():
    axis, _, data = recording()
    keep = np.r_[0:400, 450:1500]
    cut = Recording(data.t[keep], data.force[keep], data.position[keep], sample_time=0.01)
    assert identify_as_in_the_paper(cut, axis).samples == 1050


def test_the_papers_problem_moves_four_unknowns_only():
    axis, friction, data = recording()
    law = friction.as_array
    problem = PaperProblem(prepare(data, axis), axis, (0.5 * law, 1.5 * law), np.array([[0.0, 0.0]]))
    low, high = problem.bounds
    assert (low[:4] < high[:4]).all()
    assert (low[4:] == 0).all()
    assert (high[4:] == 0).all()
    assert to_unknowns(problem, law[None])[0, :4] == pytest.approx(
        [value / scale for value, scale in zip(law[[0, 1]], [problem.scales.force] * 2, strict=True)]
        + [np.log(law[2] / problem.scales.speed), law[3] * problem.scales.speed / problem.scales.force]
    )
    assert problem.refined(0.001).substeps == 10
    assert dataclasses.is_dataclass(problem.samples)
