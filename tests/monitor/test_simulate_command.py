"""`simulate` on the command line: recordings that identify can read, and a stream that a receiver acknowledges."""

import json

import numpy as np
import pytest

from monitor.cli.app import run_command
from monitor.cli.simulate import seconds
from plant.axis_file import read_axis
from plant.errors import InputError
from plant.recording_files import read_recording
from plant.scenario_file import names, read_scenario
from plant.zenoh_session import open_session
from tests.monitor.committing import committing


def run(*arguments):
    return run_command(["simulate", *map(str, arguments)])


@pytest.fixture
def endpoint(tmp_path):
    return f"unixsock-stream/{tmp_path}/z.sock"


@pytest.fixture
def receiver(endpoint):
    with open_session("peer", listen=[endpoint]) as session, committing(session) as blocks:
        yield blocks


def test_the_list_names_every_scenario_of_the_package(capsys):
    assert run("--list", "--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed["scenarios"]] == names()
    assert listed["schema_version"] == 1
    assert run("--list") == 0
    assert "wear" in capsys.readouterr().out


def test_a_written_burst_is_that_of_the_scenario_and_the_summary_tells_the_truth(tmp_path, capsys):
    out, axis_file = tmp_path / "r.parquet", tmp_path / "axis.toml"
    assert run("--scenario", "wear", "--at", "100d", "--out", out, "--write-axis", axis_file, "--json") == 0
    said = capsys.readouterr()
    summary = json.loads(said.out)
    assert said.err == ""
    burst = read_scenario("wear").burst(200)
    recording = read_recording(out, read_axis(axis_file))
    np.testing.assert_allclose(recording.position, burst.recording.position, rtol=1e-14)
    assert (summary["first_burst"], summary["bursts"], summary["of_bursts"]) == (200, 1, 360)
    assert summary["truth"]["coulomb_force"] == burst.friction.coulomb_force
    assert summary["begin"] == "2026-04-15T06:00:00Z"
    assert summary["sha256"] == burst.recording.sha256()


def test_the_seed_and_the_start_of_the_command_line_replace_those_of_the_file(tmp_path, capsys):
    arguments = ["--scenario", "wear", "--out", tmp_path / "r.csv", "--json"]
    summaries = []
    for extra in ([], ["--seed", 1], ["--seed", 9], ["--start", "2025-03-01T12:00"]):
        assert run(*arguments, *extra) == 0
        summaries.append(json.loads(capsys.readouterr().out))
    file, same, other, moved = (summary["sha256"] for summary in summaries)
    assert file == same
    assert file != other
    assert summaries[3]["begin"] == "2025-03-01T12:00:00Z"
    assert file != moved  # another time of day, another temperature


def test_people_read_one_line_and_the_true_friction(tmp_path, capsys):
    assert run("--scenario", "jam", "--out", tmp_path / "r.csv", "--duration", "2d") == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "8 bursts of the 240 of scenario jam, 16000 samples of axis-0005 from 2026-01-05 06:00 on" in words
    assert "True friction: F_c 89.28, F_s 58.43 N" in words


def test_a_published_scenario_arrives_and_is_acknowledged(endpoint, receiver, capsys):
    pace = ["--bursts-per-second", 50, "--at", "10d", "--duration", "2d"]
    assert run("--scenario", "wear", "--publish", "--connect", endpoint, *pace, "--json") == 0
    said = capsys.readouterr()
    summary = json.loads(said.out)
    assert said.err == ""
    assert (summary["bursts"], summary["samples"], summary["interrupted"]) == (4, 8000, False)
    assert summary["committed_seq"] == 7999
    assert summary["key"] == "tribowatch/plant-1/axis-0001/samples"
    assert summary["speed"] == 50 * 12 * 3600
    by_number = {block.seq: block for block in receiver}
    position = np.concatenate([by_number[number].position for number in sorted(by_number)])
    scenario = read_scenario("wear")
    expected = np.concatenate([scenario.burst(number).recording.position for number in range(20, 24)])
    np.testing.assert_array_equal(position, expected)
    assert by_number[0].t_ns[0] == scenario.begin_ns(20)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--scenario", "wear"], "give --scenario FILE or NAME with one of --out RECORDING, --publish, --can BRIDGE"),
        (["--out", "r.csv"], "give --scenario FILE or NAME"),
        (["--scenario", "wear", "--out", "r.csv", "--publish"], "one of --out RECORDING, --publish, --can BRIDGE"),
        (["--scenario", "nowhere", "--out", "r.csv"], "nowhere: no such scenario file; those that come with"),
        (["--scenario", "wear", "--out", "r.csv", "--at", "3"], "--at is '3', but must be a number with its unit"),
        (["--scenario", "wear", "--out", "r.csv", "--at", "999d"], "no burst begins within --duration"),
        (
            ["--scenario", "wear", "--out", "r.csv", "--seed", "-1"],
            "'--seed': Input should be greater than or equal to 0",
        ),
        (["--scenario", "wear", "--out", "r.csv", "--start", "noon"], "--start is 'noon', but must be a time"),
        (["--scenario", "wear", "--publish", "--speed", "0"], "--speed is 0, but must be > 0 event seconds"),
        (["--scenario", "wear", "--publish", "--bursts-per-second", "0"], "bursts per second is 0 1/s"),
        (["--scenario", "wear", "--publish", "--speed", "1", "--bursts-per-second", "1"], "exclude each other"),
    ],
)
def test_a_wrong_command_line_is_refused_in_one_line(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
    assert not list(tmp_path.iterdir())


def test_a_daemon_out_of_reach_is_said_so(endpoint, capsys):
    assert run("--scenario", "wear", "--publish", "--connect", endpoint) == 3
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("text", "value"), [("20s", 20), ("1.5h", 5400), ("7d", 604800), ("2 w", 1209600), ("5min", 300)]
)
def test_durations_are_read_with_their_unit(text, value):
    assert seconds(text, "--at") == value
    with pytest.raises(InputError):
        seconds("-" + text, "--at")
