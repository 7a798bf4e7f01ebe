"""An optimum of a weak observer counts where the next stronger one leads there, and not otherwise."""

import numpy as np
import pytest

from identify.identification import fit
from identify.preprocess import prepare
from identify.reach import reachable
from identify.uncertainty import uncertainty
from tests.identify.studies.machines import Setting, draw_case


def fitted(seed, setting):
    """Problem, where the search ended, and the scaled truth of the friction."""
    case = draw_case(seed, setting)
    problem, found = fit(prepare(case.recording, case.axis), case.axis, np.random.default_rng(seed))
    return problem, found, problem.encode(case.truth)[:4]


def misses(problem, found, truth):
    """Largest error of the friction in half-widths of its 95 % intervals."""
    half = uncertainty(problem, found.x, found.gain).half_widths(np.eye(len(found.x)))[:4]
    return float(np.abs((found.x[:4] - truth) / half).max())


@pytest.mark.parametrize("seed", [3, 42, 125])
def test_a_dent_beside_the_needle_gives_way_to_the_stronger_observers_answer(seed):
    problem, found, truth = fitted(seed, Setting("loop", dirt=0.0))
    assert misses(problem, found, truth) > 3.0  # intervals of a needle, but not its place
    kept = reachable(problem, found)
    assert kept.setting[1] > found.setting[1]
    assert misses(problem, kept, truth) < 1.2


def test_an_optimum_that_its_neighbour_leads_to_stays_what_it_is():
    ends = [fitted(seed, Setting(dirt=0.0, samples=1500))[:2] for seed in range(10)]
    assert sum(reachable(problem, found) is found for problem, found in ends) >= 9


def test_a_stronger_observer_is_not_asked_again():
    problem, found, _ = fitted(0, Setting(samples=1500))
    assert found.setting[1] > 10.0
    assert reachable(problem, found) is found
