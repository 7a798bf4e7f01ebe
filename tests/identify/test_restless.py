"""A loop whose logged force jumps from sample to sample: did the axis feel it?"""

import dataclasses
import itertools

import numpy as np
import pytest

from identify.mismatch.baseline import felt
from identify.mismatch.data import gather
from tests.identify.small_machine import AXIS, HELD, driven, dry

JUMPS = 60.0  # N, standard deviation


def jumping(seed: int):
    """A machine whose force jumps at every sample, its log without the jumps, and the jumps. [N]"""
    white = JUMPS * np.random.default_rng([seed, 1]).standard_normal(4000)
    step = itertools.count()
    smooth = driven(seed, lambda _t, _y, v: (dry(v), 0.0), delivers=lambda told, _: told + white[next(step) // HELD])
    return smooth, white[: len(smooth.t)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_axis_says_whether_it_felt_the_jumps_of_its_logged_force(seed):
    smooth, white = jumping(seed)
    for jumps, moved in ((white, True), (np.random.default_rng(seed).permutation(white), False)):
        logged = gather([dataclasses.replace(smooth, force=smooth.force + jumps)], AXIS)
        assert felt(logged, AXIS, 0) is moved
