"""The quick faults of the fault table against a real daemon; `make faults` does them all."""

import pytest

from tests.scenarios.faults import FAULTS, run_fault

SLICE = ("epoch that ended is replayed", "clock steps +1 h, -2 h", "doubled and reordered blocks")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in SLICE else pytest.mark.slow) for name in FAULTS]
)
def test_what_is_lost_is_reported_to_the_sample(name, tmp_path):
    row = run_fault(name, tmp_path)
    assert row["as_expected"], row
