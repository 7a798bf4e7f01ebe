"""A slice of the blind-start study (`make blind-starts` for all of it): every machine ends in the right basin."""

import numpy as np
import pytest

from tests.identify.studies.blind_starts import EXCITATIONS, cell

GOAL = {"sine": (1.0, 1.0, 8.0, 1.0), "multi": (0.6, 0.6, 4.0, 0.6), "loop": (2.5, 1.5, 12.0, 3.0)}  # %, few machines


@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_blind_starts_end_in_the_right_basin(excitation):
    starts = cell(excitation, 1e-4, plants=8, samples=2500)
    assert all(start.right for start in starts)
    assert all(start.verdict == "identified" for start in starts)
    assert np.all(100 * np.median([start.errors for start in starts], axis=0) <= GOAL[excitation])
