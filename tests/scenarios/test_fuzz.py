"""A slice of the hostile million; `make fuzz` sends them all."""

import pytest

from tests.scenarios.fuzz import KINDS, run, wrong


@pytest.mark.parametrize("seed", [1, 2])
def test_hostile_payloads_are_each_counted_none_trips_us_and_the_neighbour_is_served(tmp_path, seed):
    row = run(tmp_path, 150 * len(KINDS), seed)
    assert wrong(row, grown_mb=30.0) == [], row


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_million_of_them(tmp_path):
    row = run(tmp_path, 1_000_000)
    assert wrong(row, grown_mb=30.0) == [], row
