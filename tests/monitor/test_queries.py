"""Questions to the history: ranges in event time, roll-up, words for time, and what is refused."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.errors import QueryError
from monitor.estimate import Parameter
from monitor.queries import Reader
from monitor.query_zenoh import answer
from monitor.samples import Outcome, StreamState, Window, WindowId
from monitor.store import Store
from monitor.times import iso, parse_duration, parse_time, span
from plant.presets import paper_axis
from tests.monitor.estimates import DAY_NS, estimate

N = 250


@pytest.fixture(scope="module")
def reader(module_history_url):
    """A thousand days of one axis whose Coulomb force grows by 0.1 N a day."""
    url = module_history_url
    store = Store(url)
    axis = store.register([dataclasses.replace(paper_axis(), name="axis-1")])["axis-1"]
    windows = [Window(WindowId(1, k * 2000, 2000), k * DAY_NS, k * DAY_NS + 20 * 10**9) for k in range(N)]
    axis.stream, axis.last_ns = StreamState(1, N * 2000, windows[-1].end_ns), windows[-1].end_ns
    for k, (_, row, window) in enumerate(store.commit([(axis, Outcome(windows=windows))])):
        parameters = (Parameter("coulomb_force", 90 + 0.1 * k, "N", 89 + 0.1 * k, 91 + 0.1 * k),)
        store.save(axis, row, dataclasses.replace(estimate(k), window=window, parameters=parameters), [], [], [])
    store.close()
    with Reader(url) as one:
        yield one


def points(reader, **asked):
    return reader.history("axis-1", parameter="coulomb_force", **asked)["series"]["coulomb_force"]["points"]


def test_all_answers_come_as_they_are_when_they_fit(reader):
    got = points(reader, points=N)
    assert len(got) == N
    assert got[10]["value"] == pytest.approx(91.0)
    assert got[10]["ci95"] == pytest.approx([90.0, 92.0])
    assert got[10]["t"] == iso(10 * DAY_NS + 20 * 10**9)


@pytest.mark.parametrize("most", [1, 7, 100, 249])
def test_roll_up_keeps_mean_extremes_and_number(reader, most):
    got = points(reader, points=most)
    assert 0.5 * most < len(got) <= most
    assert sum(one["answers"] for one in got) == N
    assert min(one["min"] for one in got) == pytest.approx(90.0)
    assert max(one["max"] for one in got) == pytest.approx(90 + 0.1 * (N - 1))
    mean = np.average([one["value"] for one in got], weights=[one["answers"] for one in got])
    assert mean == pytest.approx(90 + 0.05 * (N - 1))
    assert all(one["min"] <= one["value"] <= one["max"] for one in got)


def test_since_counts_back_from_the_latest_sample(reader):
    assert len(points(reader, since_ns=parse_duration("7d"))) == 8


def test_from_and_to_are_inclusive(reader):
    assert len(points(reader, from_ns=5 * DAY_NS, to_ns=7 * DAY_NS + 20 * 10**9)) == 3


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"parameter": "coulomb"}, "coulomb_force"),
        ({"points": 0}, "points is 0"),
        ({"since_ns": 1, "from_ns": 1}, "exclude each other"),
        ({"from_ns": 2 * DAY_NS, "to_ns": DAY_NS}, "later than"),
    ],
)
def test_what_cannot_be_answered_is_said(reader, asked, said):
    with pytest.raises(QueryError, match=said):
        reader.history("axis-1", **asked)


def test_the_same_answer_over_zenoh(reader):
    key = "tribowatch/plant-1/axis-1/history/parameters"
    asked = {"parameter": "coulomb_force", "since": "30d", "points": "10"}
    got = answer(reader, key, asked, "tribowatch")
    assert got == reader.history("axis-1", parameter="coulomb_force", since_ns=30 * DAY_NS, points=10)
    ranged = answer(reader, key, {"from": "1970-01-03T00:00:00Z", "to": iso(4 * DAY_NS)}, "tribowatch")
    assert ranged == reader.history("axis-1", from_ns=2 * DAY_NS, to_ns=4 * DAY_NS)


@pytest.mark.parametrize(
    ("axis", "asked", "said"),
    [
        ("*", {}, "wildcards"),
        ("axis-1", {"form": "1970"}, "'form' is not known"),
        ("axis-1", {"from": "yesterday"}, "not understood"),
        ("axis-1", {"since": "7 moons"}, "not understood"),
        ("axis-1", {"points": "1e3"}, "whole number"),
        ("axis-2", {}, "axis-1"),
    ],
)
def test_a_bad_query_gets_an_answer_that_says_why(reader, axis, asked, said):
    with pytest.raises(QueryError, match=said):
        answer(reader, f"tribowatch/plant-1/{axis}/history/parameters", asked, "tribowatch")


@pytest.mark.parametrize(
    ("text", "t_ns"),
    [
        ("1970-01-02", DAY_NS),
        ("1970-01-01T00:00:01.5Z", 1_500_000_000),
        ("1970-01-01T01:00:00+01:00", 0),
        ("1767225600000000001", 1_767_225_600_000_000_001),
    ],
)
def test_times_in_words(text, t_ns):
    assert parse_time(text) == t_ns


@pytest.mark.parametrize(("text", "days"), [("7d", 7), ("12h", 0.5), ("1.5w", 10.5), ("1440min", 1), ("86400 s", 1)])
def test_spans_in_words(text, days):
    assert parse_duration(text) == days * DAY_NS


def test_spans_to_words():
    assert [span(n) for n in (10**9, 90 * 10**9, 3 * DAY_NS, 800 * DAY_NS)] == ["1 s", "90 s", "3 d", "2.19 y"]


# --- roll-ups ---------------------------------------------------------------------------------------------------

MANY = 250


def fill(url, times_ns, values, name="axis-1"):
    """Answers at `times_ns`, some without interval."""
    store = Store(url)
    axis = store.register([dataclasses.replace(paper_axis(), name=name)])[name]
    axis.last_ns = int(times_ns[-1])
    windows = [Window(WindowId(1, k * 10, 10), int(t) - 10**9, int(t)) for k, t in enumerate(times_ns)]
    for k, (_, row, window) in enumerate(store.commit([(axis, Outcome(windows=windows))])):
        bounds = (float(values[k]) - 1, float(values[k]) + 2) if k % 4 else (None, None)
        parameters = (Parameter("F", float(values[k]), "N", *bounds),)
        store.save(axis, row, dataclasses.replace(estimate(0), window=window, parameters=parameters), [], [], [])
    return store, axis


@pytest.fixture(scope="module")
def dense(module_history_url):
    """Answers at irregular times over 40 days, with a long pause; (reader, times, values)."""
    rng = np.random.default_rng(8)
    gaps = rng.exponential(40 * 86_400e9 / MANY, MANY) * (1 + 300 * (np.arange(MANY) == 120))
    times, values = np.cumsum(gaps).astype(np.int64) + 10**15, rng.normal(90, 5, MANY)
    fill(module_history_url, times, values, "dense")[0].close()
    with Reader(module_history_url) as one:
        yield one, times, values


def check_points(got, times, values, most):
    assert len(got) <= most
    assert sum(one["answers"] for one in got) == len(values)
    if not len(values):
        return
    stamps = [one["t_ns"] for one in got]
    assert stamps == sorted(set(stamps))
    assert set(stamps) <= set(times.tolist())
    assert (min(one["min"] for one in got), max(one["max"] for one in got)) == (values.min(), values.max())
    mean = np.average([one["value"] for one in got], weights=[one["answers"] for one in got])
    assert mean == pytest.approx(values.mean())
    for one in got:
        assert one["min"] - 1e-9 <= one["value"] <= one["max"] + 1e-9
        if one["ci95"]:
            assert one["ci95"][1] - one["ci95"][0] == pytest.approx(3.0)


@given(st.integers(1, 600), st.floats(-0.1, 1.1), st.floats(0, 1.1))
@settings(max_examples=30)
def test_any_range_in_any_number_of_points_is_what_the_answers_say(dense, most, begin, length):
    reader, times, values = dense
    span = int(times[-1] - times[0])
    from_ns = int(times[0]) + int(begin * span)
    to_ns = from_ns + int(length * span)
    inside = (times >= from_ns) & (times <= to_ns)
    got = reader.history("dense", parameter="F", from_ns=from_ns, to_ns=to_ns, points=most)["series"]["F"]
    assert got["answers"] == inside.sum()
    check_points(got["points"], times, values[inside], most)


def test_thinned_out_the_trend_stays(history_url):
    rng = np.random.default_rng(9)
    times, values = 10**15 + np.arange(200) * 6 * 3_600 * 10**9, rng.normal(90, 5, 200)  # 50 days
    store, axis = fill(history_url, times, values)
    with Reader(history_url) as reader:
        before = reader.history("axis-1", points=40)["series"]
        assert store.thin_out(axis.id, int(times[100]), limit=50) == 50
        while store.thin_out(axis.id, int(times[100]), limit=50):
            pass
        assert reader.history("axis-1", points=40)["series"]["F"]["points"] == [
            one | {"value": pytest.approx(one["value"]), "ci95": pytest.approx(one["ci95"])}
            for one in before["F"]["points"]
        ]
        check_points(reader.history("axis-1", points=1000)["series"]["F"]["points"], times, values, 1000)
        old = reader.history("axis-1", to_ns=int(times[50]), points=20)["series"]["F"]
        assert 45 <= old["answers"] <= 51  # up to the whole hour, or day, of the bound
        assert reader.axis("axis-1").verdicts == {"identified": 200}
    store.close()
