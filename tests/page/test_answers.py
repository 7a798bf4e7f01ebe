"""The HTTP API: the same answers as command line and Zenoh, errors that say what to do, events, metrics."""

import json
import re
import threading

import pytest
from prometheus_client.parser import text_string_to_metric_families

from monitor.http_answers import ANSWERS
from monitor.queries import Reader
from monitor.query_page import PageReader
from monitor.query_zenoh import answer as zenoh_answer
from monitor.store import Store
from tests.contracts.command import ROOT, tribowatch
from tests.page.histories import named, write_axis_history

BOUNDED = {"axis", "kind", "state", "priority", "verdict", "code", "le", "version", "python"}  # labels of few values


def get(served, path, **asked):
    response = served.get(f"/api/v1{path}", params=asked)
    assert response.status_code == 200, response.text
    return response.json()


def test_the_same_answers_as_the_reader_and_zenoh(served, history):
    with Reader(f"sqlite:///{history / 'tribowatch.db'}") as reader:
        asked = {"parameter": "coulomb_force", "since": "20d", "points": "10"}
        key = f"tribowatch/{served.config.site}/axis-2/history/"
        assert get(served, "/axes/axis-2/history", **asked) == zenoh_answer(
            reader, key + "parameters", asked, "tribowatch"
        )
        assert get(served, "/axes/axis-2/alerts") == zenoh_answer(reader, key + "alerts", {}, "tribowatch")
        assert get(served, "/axes")["axes"] == [one.to_dict() for one in reader.axes()]
        assert get(served, "/axes/axis-1")["latest"] == reader.axis("axis-1").to_dict()["latest"]
        assert get(served, "/alerts")["transitions"] == reader.transitions()


def test_the_same_answers_as_the_command_line(served, history):
    done = tribowatch("history", "axis-2", "--state-dir", history, "--json")
    assert done.returncode == 0, done.stderr
    assert get(served, "/axes/axis-2/history") == json.loads(done.stdout)


def test_the_fleet_begins_with_what_needs_somebody(served):
    axes = get(served, "/fleet")["axes"]
    assert [one["axis"] for one in axes] == ["axis-2", "axis-new", "axis-1"]
    worn, new, well = axes
    assert worn["urgency"]["word"] == "look soon"
    assert worn["alarms"][0]["kind"] in ("wear", "lubrication")
    assert worn["height"] > 1 > well["height"]
    assert worn["change"] > 0.05 > abs(well["change"])
    assert new["urgency"]["word"] == "never heard"
    assert new["friction"] is None
    assert len(worn["trend"]) > 10
    assert worn["trend"][-1] > worn["trend"][0]
    assert worn["friction"]["unit"] == "N"
    assert worn["friction"]["ci95"][0] < worn["friction"]["value"] < worn["friction"]["ci95"][1]


def test_curves_and_charts_of_an_axis(served):
    curves = get(served, "/axes/axis-2/curves")
    baseline, now = curves["baseline"], curves["now"]
    assert all(
        low < mean < high for low, mean, high in zip(baseline["low"], baseline["values"], baseline["high"], strict=True)
    )
    assert now["values"][-1] > baseline["values"][-1]
    watch = get(served, "/axes/axis-2/watch", points=20)
    assert 10 <= len(watch["t_ns"]) <= 20
    assert watch["t_ns"] == sorted(watch["t_ns"])
    columns = [*(one["up"] for one in watch["charts"].values()), *watch["conditions"].values()]
    assert {len(one) for one in columns} == {len(watch["t_ns"])}
    assert sum(one["windows"] for one in watch["verdicts"]) == watch["windows"] == 80


def test_every_address_is_documented_and_answers(served):
    page = (ROOT / "docs" / "http-api.md").read_text(encoding="utf-8")
    for path in [*ANSWERS, "/status", "/events", "/evidence/{number}", "/axes/{axis}/commands/{action}"]:
        assert f"`/api/v1{path}`" in page, f"{path} is not documented"
    for path in ANSWERS:
        content = get(served, path.format(axis="axis-2", number=1))
        assert content["schema_version"] == 1
    assert get(served, "/status")["axes"]["listed"] == 3


@pytest.mark.parametrize(
    ("path", "code", "said"),
    [
        ("/api/v1/axes/axis-3", 404, "axis-"),
        ("/api/v1/axes/axis-1/history?parameter=coulomb_forse", 404, "coulomb_force"),
        ("/api/v1/axes/axis-1/history?since=7moons", 400, "not understood"),
        ("/api/v1/axes/axis-1/history?points=1e9", 400, "whole number"),
        ("/api/v1/axes/axis-1/watch?form=2026", 400, "'form' is not known"),
        ("/api/v1/nothing", 404, "docs/http-api.md"),
        ("/api/v1/evidence/77", 404, "no evidence number 77"),
        ("/api/v1/axes/axis-2/diagnoses/9", 404, "no diagnosis number 9"),
        ("/api/v1/../../etc/passwd", 404, "nothing is at"),
        ("/static/x/..%2f..%2fhttp_app.py", 404, "nothing is at"),
    ],
)
def test_what_cannot_be_answered_is_said(served, path, code, said):
    response = served.get(path)
    assert response.status_code == code
    assert said in response.json()["error"]


def test_events_tell_what_is_published_and_what_was_missed(served):
    heard: list[tuple[str, dict]] = []
    greeted, told = threading.Event(), threading.Event()

    def listen():
        with served.client.stream("GET", "/api/v1/events", headers={"last-event-id": "0"}) as response:
            assert response.headers["content-type"].startswith("text/event-stream")
            kind = ""
            for line in response.iter_lines():
                if line.startswith("event: "):
                    kind = line[7:]
                elif line.startswith("data: "):
                    heard.append((kind, json.loads(line[6:])))
                    if kind == "hello":
                        greeted.set()
                    if kind == "change":
                        told.set()
                        return

    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    assert greeted.wait(30)
    for axis in ("axis-1", "axis-2", "axis-1"):
        served.server.hear("status", axis, {})
    assert told.wait(30)
    listener.join(30)
    assert heard[0][0] == "alert"  # of the history: this listener says it has seen none
    assert heard[0][1]["axis"] == "axis-2"
    assert heard[-1][1]["axes"] == {"axis-1": ["status"], "axis-2": ["status"]}


def test_metrics_are_what_prometheus_reads(served):
    text = served.get("/metrics").text
    families = {one.name: one for one in text_string_to_metric_families(text)}
    wanted = re.compile(r"tribowatch_[a-z]+(_[a-z]+)*|process_[a-z_]+")
    for name, family in families.items():
        assert wanted.fullmatch(name), name
        assert family.documentation
        assert not name.endswith(("_count", "_sum", "_milliseconds", "_kilobytes", "_percent")), name
        for sample in family.samples:
            assert family.type != "counter" or sample.name.endswith(("_total", "_created")), sample.name
            assert set(sample.labels) <= {
                "axis",
                "kind",
                "state",
                "priority",
                "verdict",
                "code",
                "le",
                "version",
                "python",
            }
    friction = {one.labels["axis"]: one.value for one in families["tribowatch_axis_coulomb_friction_newtons"].samples}
    assert friction["axis-2"] > friction["axis-1"]
    assert families["tribowatch_alarm_standing"].samples[0].labels["axis"] == "axis-2"


def test_health_follows_the_supervising_thread(served):
    served.board.turn(0, 0, 0)
    assert served.get("/healthz").json()["status"] == "ok"
    served.board.beat = type(served.board.beat)(served.board.beat.at - 3600)
    response = served.get("/healthz")
    served.board.turn(0, 0, 0)
    assert response.status_code == 503
    assert "has not come round" in response.json()["error"]


def test_the_fleet_reads_alike_from_both_databases(history_url):
    """What is picked out of JSON by the database itself: SQLite and PostgreSQL say it differently."""
    store = Store(history_url)
    write_axis_history(store, named("axis-1"), 24)
    write_axis_history(store, named("axis-2"), 6)
    store.register([named(f"axis-{k}") for k in (1, 2, 3)])
    store.close()
    with PageReader(history_url) as reader:
        found = {one["axis"]: one for one in reader.fleet()}
        state = {one.name: one.learning for one in reader.axes()}
        watch = reader.watched("axis-1", points=5)
    assert {name: one["baseline"] for name, one in found.items()} == state
    assert found["axis-1"]["baseline"]["complete"]
    assert found["axis-2"]["baseline"] == {"complete": False, "windows": 6}
    assert found["axis-3"]["baseline"]["windows"] == 0
    assert len(found["axis-1"]["trend"]) >= 2
    assert len(watch["t_ns"]) <= 5
