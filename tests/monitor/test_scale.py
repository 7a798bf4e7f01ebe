"""The cost of an axis does not grow with the number of axes; `make bench-scale` goes up to a thousand."""

from tests.benchmarks.scale_corridor import cost


def test_an_axis_costs_no_more_among_many(tmp_path):
    cost(tmp_path, 1, 2)  # warm
    few, many = cost(tmp_path, 20, 15), cost(tmp_path, 200, 10)
    assert many < 1.3 * few
