"""`replay` on the command line, against a receiver that keeps the contract of docs/stream.md."""

import json

import numpy as np
import pytest

from monitor.cli.app import run_command
from plant.axis import Axis, Mechanics, Orientation
from plant.axis_file import write_axis
from plant.recording import Recording
from plant.recording_files import write_recording
from plant.zenoh_session import open_session
from tests.monitor.committing import committing

AXIS = Axis("x-1", Mechanics(Orientation.HORIZONTAL, M=5.0, force_per_torque=4.0))


@pytest.fixture
def setting(tmp_path):
    t = 0.01 * np.arange(250)
    write_axis(AXIS, tmp_path / "axis.toml")
    write_recording(Recording(t, np.sin(t), np.cos(t)), tmp_path / "r.csv", AXIS)
    return tmp_path, f"unixsock-stream/{tmp_path}/z.sock"


@pytest.fixture
def receiver(setting):
    _, endpoint = setting
    with open_session("peer", listen=[endpoint]) as session, committing(session) as blocks:
        yield blocks


def run(folder, *arguments):
    return run_command(["replay", *map(str, arguments), "--axis", str(folder / "axis.toml")])


def test_two_recordings_twice_arrive_as_force_and_are_all_committed(setting, receiver, capsys):
    folder, endpoint = setting
    files = [folder / "r.csv", folder / "r.csv"]
    start = ["--start", "2026-01-05T06:00:00Z", "--json"]
    assert run(folder, *files, "--speed", "max", "--repeat", 2, "--connect", endpoint, *start) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert said.err == ""
    assert (result["samples"], result["blocks"], result["acknowledged"], result["skipped"]) == (1000, 12, True, 0)
    np.testing.assert_allclose(receiver[0].force, np.sin(0.01 * np.arange(100)), atol=1e-15)
    assert receiver[0].t_ns[0] == 1_767_592_800_000_000_000
    assert receiver[0].epoch == result["epoch"]


def test_for_people_it_says_what_became_of_the_samples(setting, receiver, capsys):
    folder, endpoint = setting
    assert run(folder, folder / "r.csv", "--speed", 50, "--connect", endpoint) == 0
    assert "x-1: 250 samples in 3 blocks sent in" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.csv"], "no such recording"),
        ([], "no [[recording]] is listed"),
        (["r.csv", "--speed", "fast"], "'fast'"),
        (["r.csv", "--speed", "-1"], "speed is -1"),
        (["r.csv", "--repeat", "0"], "repeat is 0"),
        (["r.csv", "--start", "noon"], "'noon'"),
        (["r.csv", "--site", "a/b"], "site is"),
    ],
)
def test_bad_arguments_are_one_line_each(setting, receiver, arguments, words, capsys, monkeypatch):
    folder, endpoint = setting
    monkeypatch.chdir(folder)
    assert run(folder, *arguments, "--connect", endpoint) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_no_daemon_is_exit_3(setting, capsys, monkeypatch):
    folder, endpoint = setting
    from plant import zenoh_session

    real = zenoh_session.open_session
    monkeypatch.setattr(zenoh_session, "open_session", lambda *a, **k: real(*a, **k, timeout=0.1))
    assert run(folder, folder / "r.csv", "--connect", endpoint) == 3
    assert "no daemon at unixsock-stream/" in capsys.readouterr().err


def test_a_daemon_that_commits_nothing_is_exit_3_with_what_was_sent(setting, capsys, monkeypatch):
    folder, endpoint = setting
    import plant.replay

    real = plant.replay.ReplaySettings
    monkeypatch.setattr(plant.replay, "ReplaySettings", lambda **k: real(**k, stall=0.2))
    with open_session("peer", listen=[endpoint]):
        assert run(folder, folder / "r.csv", "--speed", 100, "--connect", endpoint, "--json") == 3
    said = capsys.readouterr()
    assert json.loads(said.out)["acknowledged"] is False
    assert "has committed 0 of 250 samples of x-1" in said.err
