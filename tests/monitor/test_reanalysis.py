"""Stored windows identified again: the same program gives the same answers, and what is stored stays as it is."""

import dataclasses
import json
import sqlite3

import pytest

from monitor.cli import app  # noqa: F401  registers the commands
from monitor.cli.app import run_command
from monitor.errors import QueryError
from monitor.query_raw import RawReader
from monitor.reanalysis import figures, reanalyse
from monitor.reanalysis_compare import Likeness, likeness
from monitor.store import Store
from monitor.store_reanalysis import Order, Target
from tests.monitor.test_pipeline import AXIS, Bench, workers  # noqa: F401  a fixture
from tests.scenarios.harness import START_NS, blocks_of, burst

DAY_NS = 86_400 * 10**9
DAYS = 5


@pytest.fixture(scope="module")
def kept(tmp_path_factory, workers):  # noqa: F811
    """A history of five windows with their raw samples; its folder and URL."""
    folder = tmp_path_factory.mktemp("kept")
    bench = Bench(folder, workers, window={"samples": 600, "hop": 600})
    for day in range(DAYS):
        torque, position = burst(AXIS, samples=600, seed=day)
        for block in blocks_of("axis-1", 1, 600 * day, START_NS + day * DAY_NS, torque, position):
            bench.put(block)
    bench.finish()
    bench.store.close()
    return folder, bench.url


def again(url, folder, workers, tell=lambda *_: None, **asked):  # noqa: F811
    """One run of a re-analysis on running workers; its figures."""
    order = Order(url, **asked)
    target = Target(folder, order)
    try:
        with RawReader(url) as reader:
            return figures(reanalyse(reader, order, target, lambda wake: Lent(workers, wake), tell))
    finally:
        target.close()


class Lent:
    """Workers that go on for the next test."""

    def __init__(self, workers, wake):  # noqa: F811
        self._workers, workers._wake = workers, wake

    def __getattr__(self, name):
        return getattr(self._workers, name)

    def close(self):
        pass


def stored(url):
    with sqlite3.connect(url.removeprefix("sqlite:///")) as db:
        return list(db.iterdump())


def test_the_same_program_gives_the_same_answers_and_changes_nothing(kept, workers, tmp_path):  # noqa: F811
    url, before, seen = kept[1], stored(kept[1]), []
    found = again(url, tmp_path / "new", workers, lambda *numbers: seen.append(numbers))
    assert (found["windows"], found["same"], found["moved"], found["verdict"]) == (DAYS, DAYS, 0, 0)
    assert seen[-1] == (DAYS, DAYS, DAYS)
    assert stored(url) == before
    with RawReader(url) as old, RawReader(f"sqlite:///{tmp_path}/new/tribowatch.db") as new:
        answers = [list(one.answered(1)) for one in (old, new)]
        assert answers[0] == answers[1], "seed, software, version of the axis, result and curve"
        assert [one.versions for one in old.stored_axes()] == [one.versions for one in new.stored_axes()]


def test_an_interrupted_run_goes_on_where_it_ended(kept, workers, tmp_path):  # noqa: F811
    class InterruptedRunError(Exception):
        pass

    def interrupt(_done, _total, fresh):
        if fresh >= 2:
            raise InterruptedRunError

    with pytest.raises(InterruptedRunError):
        again(kept[1], tmp_path, workers, interrupt)
    drain(workers)
    seen = []
    found = again(kept[1], tmp_path, workers, lambda *numbers: seen.append(numbers))
    assert found["same"] == DAYS
    assert seen[-1][2] <= DAYS - 2, "what was done is not done again"


def drain(workers):  # noqa: F811
    """What an interrupted run leaves in workers that are not its own."""
    while workers.busy:
        workers.collect()


def test_a_range_is_respected_and_lost_samples_are_counted(kept, workers, tmp_path):  # noqa: F811
    folder = tmp_path / "copy"
    folder.mkdir()
    path = folder / "tribowatch.db"
    with sqlite3.connect(kept[0] / "tribowatch.db") as old, sqlite3.connect(path) as new:
        old.backup(new)
        new.execute("delete from block where seq between 3000 - 600 and 3000")
    url = f"sqlite:///{path}"
    found = again(url, tmp_path / "new", workers, since_ns=round(2.5 * DAY_NS))
    assert (found["windows"], found["same"], found["raw_gone"]) == (3, 2, 1)


def test_todays_model_may_be_asked_for(kept, workers, tmp_path):  # noqa: F811
    folder = tmp_path / "copy"
    folder.mkdir()
    with sqlite3.connect(kept[0] / "tribowatch.db") as old, sqlite3.connect(folder / "tribowatch.db") as new:
        old.backup(new)
    url = f"sqlite:///{folder / 'tribowatch.db'}"
    store = Store(url)
    heavier = dataclasses.replace(AXIS.mechanics, M=AXIS.mechanics.M * 1.5)
    store.register([dataclasses.replace(AXIS, mechanics=heavier)])
    store.close()
    assert again(url, tmp_path / "then", workers)["same"] == DAYS
    found = again(url, tmp_path / "present", workers, present=True)
    assert found["same"] == 0
    assert found["moved"] + found["verdict"] == DAYS
    assert found["axes"][0]["differing"][0]["software"]["then"] == found["axes"][0]["differing"][0]["software"]["now"]


def test_likeness_is_measured_in_stated_intervals(kept):
    with RawReader(kept[1]) as reader:
        one = next(iter(reader.answered(1)))
    assert one.verdict == "identified"
    name, told = next((name, told) for name, told in one.result["parameters"].items() if told["ci95"])
    length = told["ci95"][1] - told["ci95"][0]

    def moved(by):
        parameters = {**one.result["parameters"], name: {**told, "value": told["value"] + by * length}}
        return dataclasses.replace(one, result={**one.result, "parameters": parameters})

    assert likeness(one, one) == (Likeness.SAME, 0.0)
    assert likeness(one, moved(5e-4))[0] is Likeness.CLOSE
    assert likeness(one, moved(2e-3))[0] is Likeness.MOVED
    assert likeness(one, dataclasses.replace(one, verdict="bad_data"))[0] is Likeness.VERDICT


def test_the_command_says_what_came_out_and_refuses_what_would_mix_histories(kept, tmp_path, capsys):
    source, new = ("--state-dir", str(kept[0])), str(tmp_path / "new")
    command = ["history", "reanalyse", "--into", new, *source, "--workers", "1"]
    assert run_command([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["same"], told["fresh"], told["windows"]) == (DAYS, DAYS, DAYS)
    assert run_command(command) == 0
    assert "0 windows identified now" in capsys.readouterr().out
    assert run_command(["history", "axis-1", "--state-dir", new]) == 0
    assert f"{DAYS} windows identified" in capsys.readouterr().out
    for wrong, said in (
        (["--model", "present"], "holds a re-analysis with model 'then'"),
        (["--into", str(kept[0])], "where the history itself is"),
        (["nobody"], "axis 'nobody' is not in the history"),
        (["--since", "soon"], "not understood"),
        (["--scheduler", "tcp://127.0.0.1:9"], "no Dask scheduler"),
    ):
        assert run_command([*command, *wrong]) in (2, 3)
        said_all = capsys.readouterr()
        assert said in said_all.err
        assert len(said_all.err.strip().splitlines()) == 1
        assert said_all.out == ""


@pytest.mark.parametrize("text", ["", "[1]", "no JSON"])
def test_a_folder_with_a_note_that_is_none_is_refused(tmp_path, text):
    (tmp_path / "reanalysis.json").write_text(text)
    with pytest.raises(QueryError, match="choose another folder"):
        Target(tmp_path, Order("sqlite:///x"))
