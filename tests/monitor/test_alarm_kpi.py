"""Figures of ISA-18.2 from an audit whose answers are known, and alerts that belong together."""

import pytest

from monitor.alarm_groups import groups_of
from monitor.alarm_kpi import DAY_NS, HOUR_NS, Move, figures
from monitor.queries import Reader
from monitor.query_zenoh import answer
from tests.monitor.test_alarm_desk import GONE, JAM, site  # noqa: F401  a fixture

MINUTE = HOUR_NS // 60


def raised(axis, kind, at_ns, before="normal", priority="medium"):
    return Move(axis, kind, priority, "holds", before, "unacknowledged", at_ns)


def moved(axis, kind, at_ns, event, before, after, author=""):
    return Move(axis, kind, "medium", event, before, after, at_ns, author)


def test_a_quiet_plant():
    told = figures([], 0, 10 * DAY_NS)
    assert (told["raised"], told["per_day"], told["top_share"], told["hours_to_acknowledge"]) == (0, 0.0, 0.0, None)
    assert told["stale"] == told["bad_actors"] == told["chattering"] == []


def test_each_figure_is_what_the_audit_says():
    moves = [
        raised("a", "wear", 0, priority="high"),
        moved("a", "wear", 3 * HOUR_NS, "acknowledge", "unacknowledged", "acknowledged", "Ada"),
        *(raised("b", "stale", DAY_NS + k * HOUR_NS, "returned_unacknowledged" if k else "normal") for k in range(3)),
        *(raised(f"c{k}", "stale", 5 * DAY_NS + k * MINUTE // 4) for k in range(12)),
        moved("b", "stale", 6 * DAY_NS, "shelve", "unacknowledged", "shelved", "Bob"),
    ]
    told = figures(moves, 0, 10 * DAY_NS)
    assert (told["raised"], told["per_day"]) == (16, pytest.approx(1.6))
    assert told["peak_per_ten_minutes"] == 12
    assert told["flood_share"] == pytest.approx(1 / 1440)
    assert told["chattering"] == [{"axis": "b", "kind": "stale", "raised": 3}]
    assert told["bad_actors"][0] == {"axis": "b", "kind": "stale", "raised": 3, "share": 3 / 16}
    assert told["top_share"] == pytest.approx(12 / 16)
    assert told["standing"] == 13
    assert (told["stale"][0]["axis"], told["stale"][0]["days"]) == ("a", pytest.approx(10.0))
    assert told["hours_to_acknowledge"] == {"median": 3.0, "longest": 3.0}
    assert told["never_acknowledged"] == 15
    assert told["put_aside"] == {"shelved": 1}
    assert told["priorities"]["high"] == pytest.approx(1 / 16)


def test_what_happened_before_the_range_still_stands_in_it():
    moves = [raised("a", "wear", 0)]
    told = figures(moves, 5 * DAY_NS, 10 * DAY_NS)
    assert (told["raised"], told["standing"], len(told["stale"])) == (0, 1, 1)


def test_the_figures_of_a_history_are_the_same_by_reader_and_by_zenoh(site):  # noqa: F811
    site.observe(JAM)
    site.pass_time(event=2 * HOUR_NS)
    site.do("acknowledge")
    site.observe(GONE)
    with Reader(site.url) as reader:
        told = reader.alarm_figures("axis-1")
        assert (told["raised"], told["standing"], told["hours_to_acknowledge"]["median"]) == (1, 0, 2.0)
        assert answer(reader, "tribowatch/s/axis-1/history/kpi", {}, "tribowatch") == told
        assert reader.alarm_figures(since_ns=DAY_NS)["raised"] in (0, 1)
        assert answer(reader, "tribowatch/s/axis-1/history/events", {}, "tribowatch")["events"] == []
        assert len(answer(reader, "tribowatch/s/axis-1/history/versions", {}, "tribowatch")["versions"]) == 1


def alert(axis, kind, at_ns, priority="low"):
    return {"id": f"s/{axis}/{kind}/1", "axis": axis, "kind": kind, "since_ns": at_ns, "priority": priority}


def test_one_fault_on_many_axes_is_one_group_and_the_rest_goes_by_axis():
    many = [alert(f"a{k}", "stale", k * MINUTE) for k in range(4)]
    later = alert("a9", "stale", DAY_NS)
    worn = [alert("a1", "wear", DAY_NS, "medium"), alert("a1", "jam", DAY_NS, "high")]
    groups = groups_of([*many, later, *worn])
    assert [one["about"] for one in groups] == ["a1", "stale on 4 axes at the same time", "a9"]
    assert (groups[0]["priority"], len(groups[0]["alerts"])) == ("high", 2)
    assert sorted(name for one in groups for name in one["alerts"]) == sorted(
        one["id"] for one in [*many, later, *worn]
    )
