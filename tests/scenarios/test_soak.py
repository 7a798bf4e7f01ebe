"""The judgement of `make soak`, and a short run of it."""

import pytest

from tests.scenarios.soak import BOUNDS, judge, run

STILL = dict.fromkeys(BOUNDS, 20.0)


def rows(**leaks):
    """Forty rows; what leaks grows by so much a row."""
    return [STILL | {name: 20.0 + rate * k for name, rate in leaks.items()} for k in range(40)]


def test_what_settles_in_the_first_half_is_no_leak():
    settled = [row | {"daemon_mb": min(20.0 + 30.0 * k, 300.0)} for k, row in enumerate(rows())]
    assert judge(settled)["beyond"] == []


@pytest.mark.parametrize("name", sorted(BOUNDS))
def test_what_grows_beyond_its_bound_in_the_second_half_is_told(name):
    assert judge(rows(**{name: 0.05 * BOUNDS[name]}))["beyond"] == []  # ten rows apart: half the bound
    assert judge(rows(**{name: 0.15 * BOUNDS[name]}))["beyond"] == [name]


@pytest.mark.slow
def test_two_minutes_of_soak(tmp_path):
    report = run(tmp_path, minutes=2.0, every=3.0, samples=20_000)
    assert report["beyond"] == []
    assert report["last"]["missing"] == 0
