"""The baseline is marched so finely that no effect is likelier only because it asks for shorter steps."""

import pytest

from identify.mismatch.baseline import LITTLE, fit_baseline
from identify.mismatch.compare import fit
from identify.mismatch.data import gather
from tests.blind.sealing import drawable
from tests.identify.studies.reading import recorded

SEED = 1_580_000  # a judge that is read


@pytest.mark.parametrize(("index", "steps"), [(0, 2), (20, 4)])
def test_shorter_steps_change_the_baseline_little(index, steps):
    """In steps of 5 ms, case 20 lost 302 of twice its log-likelihood, which any effect with shorter ones would win.

    That was before the way of a sub-step followed its forces: now it is 40.
    """
    _, _, case = drawable(SEED, index)
    axis, recordings = recorded(case)
    found = fit_baseline(gather(recordings, axis).train, axis, 0)
    assert found.problem.substeps == steps
    finer = found.problem.refined(found.problem.samples.sample_time / (2 * steps))
    assert abs(fit(finer, found.x[None]).found.criterion - found.found.criterion) < LITTLE


def test_effects_and_other_data_keep_the_steps_of_the_baseline():
    _, _, case = drawable(SEED, 20)
    axis, recordings = recorded(case)
    evidence = gather(recordings, axis)
    problem = fit_baseline(evidence.train, axis, 0).problem
    assert problem.on(evidence.held_out).substeps == problem.including(()).substeps == problem.substeps == 4
