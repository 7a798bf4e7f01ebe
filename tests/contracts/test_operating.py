"""Operating a daemon from the command line and over Zenoh, while it runs and while it does not."""

import io
import json
import re
import shutil
import socket

import pytest
import structlog

from monitor.cli import app  # noqa: F401  registers the commands
from monitor.cli.app import run_command
from plant.keys import command_key
from plant.zenoh_session import open_session
from tests.contracts.command import tribowatch
from tests.contracts.conftest import daemon


@pytest.fixture
def demo(worn, tmp_path):
    """A history with a wear alert, on a port of its own; gives the configuration file."""
    folder = tmp_path / "demo"
    shutil.copytree(worn[0], folder)
    config = folder / "tribowatch.toml"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    config.write_text(re.sub(r"127\.0\.0\.1:\d+", f"127.0.0.1:{port}", config.read_text()))
    return config


@pytest.fixture
def tell(demo, capsys):
    """Run a command on the demo's configuration; its JSON, or what it complained."""

    def run(*words, ok=True):
        code = run_command([*words, "--config", str(demo), "--json"])
        out, err = capsys.readouterr()
        if not ok:
            assert (code, out, len(err.splitlines())) == (2, "", 1), (code, out, err)
            return err
        assert code == 0, err
        return json.loads(out)

    yield run
    structlog.reset_defaults()  # the commands log to a stream that ends with the test


def test_operated_while_no_daemon_runs_then_by_the_daemon(demo, tell):
    axis = tell("alerts")["alerts"][0]["axis"]
    done = tell("alerts", "acknowledge", axis, "wear", "--author", "Ada")
    assert (done["changed"], done["state"]) == (True, "acknowledged")
    with daemon(demo):
        assert not tell("alerts", "acknowledge", axis, "wear", "--author", "Bob")["changed"]
        shelved = tell("alerts", "shelve", axis, "wear", "--for", "8h", "--author", "Bob")
        assert shelved["state"] == "shelved"
        assert shelved["until"]
        assert "30 moons" in tell("alerts", "shelve", axis, "wear", "--for", "30 moons", ok=False)
        noted = tell("axes", "event", axis, "relubricated; all four = fine", "--kind", "lubrication", "--new-baseline")
        assert noted["new_baseline"]
        assert "listed in the configuration" in tell("axes", "delete", axis, "--yes", ok=False)
        endpoint = re.search(r"tcp/127\.0\.0\.1:\d+", demo.read_text())[0]
        with open_session("client", connect=[endpoint]) as session:
            key = command_key("demo", axis)
            replies = [
                next(iter(session.get(f"{key}?{asked}")))
                for asked in ("do=unshelve;kind=wear;author=Cy", "do=unshelve;kind=waer;author=Cy", "kind=wear")
            ] + list(session.get(key, payload=b"[1]"))
        assert json.loads(replies[0].ok.payload.to_bytes())["state"] == "unacknowledged"
        refused = [json.loads(one.err.payload.to_bytes())["error"] for one in replies[1:]]
        assert "wear" in refused[0]
        assert "say what to do" in refused[1]
        assert "JSON object" in refused[2]
    moved = [one["transition"] for one in tell("alerts")["transitions"]]
    assert [(one["event"], one["author"]) for one in moved[1:]] == [
        ("acknowledge", "Ada"), ("shelve", "Bob"), ("unshelve", "Cy"),
    ]  # fmt: skip
    events = tell("axes", "events", axis)["events"]
    assert [(one["kind"], one["text"]) for one in events] == [("lubrication", "relubricated; all four = fine")]
    assert tell("axes", "rename", axis, "press-7", "--author", "Ada")["to"] == "press-7"
    assert tell("axes", "versions", "press-7")["versions"][0]["why"] == "first seen"
    assert tell("history", "press-7")["series"]
    assert "press-7" in tell("history", axis, ok=False)


def test_a_back_up_on_another_machine_gives_the_same_trend_and_alarms(demo, tmp_path):
    copy, other = tmp_path / "copy.db", tmp_path / "other"
    other.mkdir()
    for file in demo.parent.glob("*.toml"):
        shutil.copy(file, other)
    config, home = other / demo.name, {"HOME": str(other), "cwd": other}
    assert tribowatch("history", "backup", copy, "--config", demo).returncode == 0
    done = tribowatch("history", "restore", copy, "--config", config, "--yes", **home)
    assert done.returncode == 0, done.stderr
    for words in (["history", "axis-0001"], ["alerts"], ["alerts", "evidence"], ["axes", "versions", "axis-0001"]):
        here = tribowatch(*words, "--config", demo, "--json")
        there = tribowatch(*words, "--config", config, "--json", **home)
        assert (here.returncode, there.returncode) == (0, 0), here.stderr + there.stderr
        assert json.loads(here.stdout) == json.loads(there.stdout)
        assert any(json.loads(here.stdout)[name] for name in ("series", "alerts", "evidence", "versions")
                   if name in json.loads(here.stdout))  # fmt: skip
    shutil.rmtree(demo.parent)
    with daemon(config):
        assert tribowatch("alerts", "acknowledge", "axis-0001", "wear", "--config", config, **home).returncode == 0


def test_deleting_asks_first(demo, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert run_command(["axes", "delete", "axis-0001", "--config", str(demo)]) == 2


def test_nobody_to_command_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_command(["alerts", "acknowledge", "axis-0001", "wear"]) == 2
    assert "say which daemon" in capsys.readouterr().err
