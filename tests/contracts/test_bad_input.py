"""Bad input of every kind: one clear line, the right exit code, nothing on stdout; unusable samples are a verdict."""

import json
import socket
import subprocess
import sys

import pytest

from monitor.cli.app import run_command
from plant.wire import REASONS
from tests.contracts.command import AXIS, ROOT, complaint, tribowatch, write, write_configuration
from tests.contracts.conftest import wait_until


def changed(recorded, tmp_path, change):
    """The recording with its rows (lists of text, header first) changed by `change(rows)`."""
    rows = [line.split(",") for line in (recorded / "recording.csv").read_text().splitlines()]
    change(rows)
    return write(tmp_path / "changed.csv", "\n".join(",".join(row) for row in rows) + "\n")


def identify(recording, recorded, *more):
    return tribowatch("identify", recording, "--axis", recorded / "axis.toml", *more)


# --- recordings -------------------------------------------------------------------------------------------------


def test_good_recording_is_identified(recorded):
    """The reference for what follows: without the change it works."""
    result = json.loads(identify(recorded / "recording.csv", recorded, "--json").stdout)
    assert result["verdict"] == "identified"
    assert result["schema_version"] == 1


def test_missing_file(recorded):
    assert "nowhere.csv" in complaint(identify("nowhere.csv", recorded), 2)


def test_missing_axis_file(recorded, tmp_path):
    done = tribowatch("identify", recorded / "recording.csv", "--axis", tmp_path / "nowhere.toml")
    assert "nowhere.toml" in complaint(done, 2)


def test_wrong_columns_say_which_are_there_and_where_to_name_them(recorded, tmp_path):
    def rename(rows):
        rows[0] = ["time", "current", "pos", "temperature"]

    line = complaint(identify(changed(recorded, tmp_path, rename), recorded), 2)
    assert "changed.csv" in line
    assert "current" in line
    assert "columns" in line


def test_text_in_a_number_names_line_and_column(recorded, tmp_path):
    def spoil(rows):
        rows[4][1] = "abc"

    line = complaint(identify(changed(recorded, tmp_path, spoil), recorded), 2)
    assert "line 5" in line
    assert "torque" in line
    assert "'abc'" in line


def test_a_file_that_is_not_a_table(recorded, tmp_path):
    path = tmp_path / "noise.csv"
    path.write_bytes(bytes(range(256)) * 20)
    assert "noise.csv" in complaint(identify(path, recorded), 2)


def test_a_recording_without_samples(recorded, tmp_path):
    path = write(tmp_path / "empty.csv", "t,torque,position\n")
    assert "empty.csv" in complaint(identify(path, recorded), 2)


def test_nan_is_the_verdict_bad_data(recorded, tmp_path):
    def spoil(rows):
        rows[500][2] = "NaN"

    done = identify(changed(recorded, tmp_path, spoil), recorded, "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["verdict"] == "bad_data"
    assert "position" in result["reason"]


def test_time_running_backwards_is_the_verdict_bad_data(recorded, tmp_path):
    def rewind(rows):
        for row in rows[1000:1500]:
            row[0] = str(float(row[0]) - 5)

    done = identify(changed(recorded, tmp_path, rewind), recorded, "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["verdict"] == "bad_data"
    assert "time" in result["reason"]


def test_an_axis_that_stood_still_is_not_informative(recorded, tmp_path):
    def freeze(rows):
        for row in rows[1:]:
            row[2] = rows[1][2]

    done = identify(changed(recorded, tmp_path, freeze), recorded, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["verdict"] in ("not_informative", "bad_data")


def test_a_terminal_without_our_signs_gets_others(recorded):
    done = tribowatch(
        "identify", recorded / "recording.csv", "--axis", recorded / "axis.toml", PYTHONIOENCODING="ascii"
    )
    assert done.returncode == 0, done.stderr
    assert "coulomb force" in done.stdout
    assert done.stdout.isascii()


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_seed_that_is_none(recorded, command):
    done = tribowatch(command, recorded / "recording.csv", "--axis", recorded / "axis.toml", "--seed", -1)
    assert "--seed" in complaint(done, 2)


@pytest.mark.parametrize("window", ["0-2000", "-5:100", "0:999999", "x:y"])
def test_window_that_is_none(recorded, window):
    done = identify(recorded / "recording.csv", recorded, f"--window={window}")
    assert window in complaint(done, 2)


def test_unknown_method(recorded):
    assert "magic" in complaint(identify(recorded / "recording.csv", recorded, "--method", "magic"), 2)


# --- configuration and places -----------------------------------------------------------------------------------


def test_daemon_without_configuration(tmp_path):
    assert "nowhere.toml" in complaint(tribowatch("run", "--config", tmp_path / "nowhere.toml"), 2)


def test_daemon_with_an_unknown_key(tmp_path):
    line = complaint(tribowatch("run", "--config", write_configuration(tmp_path, "sight = 1\n")), 2)
    assert "sight" in line
    assert "site" in line


def test_port_in_use(tmp_path):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        config = write_configuration(tmp_path, listen=f"tcp/127.0.0.1:{port}")
        line = complaint(tribowatch("run", "--config", config), 3)
    assert str(port) in line
    assert "in use" in line


def test_endpoint_that_is_none(tmp_path):
    config = write_configuration(tmp_path, listen="somewhere")
    assert "somewhere" in complaint(tribowatch("run", "--config", config), 2)


@pytest.mark.parametrize("command", [["run"], ["history", "axis-0001"], ["alerts"], ["axes"]])
def test_database_file_that_is_not_a_database(tmp_path, command):
    config = write_configuration(tmp_path)
    (tmp_path / "var").mkdir()
    (tmp_path / "var" / "tribowatch.db").write_bytes(b"certainly not a database " * 200)
    line = complaint(tribowatch(*command, "--config", config), 3)
    assert "tribowatch.db" in line
    assert "not a database" in line


def test_state_directory_that_cannot_be_written(tmp_path):
    """A file in its place: the rights of a folder do not stop the superuser."""
    config = write_configuration(tmp_path)
    write(tmp_path / "var", "a file")
    line = complaint(tribowatch("run", "--config", config), 3)
    assert str(tmp_path / "var") in line
    assert "state_dir" in line


def test_demo_folder_that_cannot_be_written(tmp_path):
    write(tmp_path / "demo", "a file")
    assert str(tmp_path / "demo") in complaint(tribowatch("demo", "--state-dir", tmp_path / "demo"), 2)


@pytest.mark.parametrize("command", [["history", "axis-0001"], ["alerts"], ["axes"]])
def test_no_history_there_says_what_to_do(tmp_path, command):
    line = complaint(tribowatch(*command, "--state-dir", tmp_path), 3)
    assert str(tmp_path) in line
    assert "--config" in line


# --- a running daemon -------------------------------------------------------------------------------------------


def test_a_second_daemon_in_the_same_state_directory(running):
    line = complaint(tribowatch("run", "--config", running), 3)
    assert "another daemon" in line


@pytest.mark.parametrize(
    ("question", "word"),
    [
        (["history", "nobody"], "'nobody'"),
        (["history", "axis-0001", "--parameter", "colour"], "'colour'"),
        (["history", "axis-0001", "--since", "soon"], "'soon'"),
        (["history", "axis-0001", "--from", "x"], "'x'"),
        (["history", "axis-0001", "--since", "1d", "--from", "2026-01-01"], "exclude"),
        (["history", "axis-0001", "--json", "--csv"], "exclude"),
        (["history", "axis-0001", "--points", "0"], "points"),
        (["alerts", "nobody"], "'nobody'"),
    ],
)
def test_questions_that_cannot_be_answered(empty_history, capfd, question, word):
    """In this process, which the door of the command line allows: the answer is the same, and quicker."""
    code = run_command([*question, "--state-dir", str(empty_history)])
    said = capfd.readouterr()
    assert (code, said.out) == (2, "")
    assert word in said.err
    assert said.err.count("\n") == 1


@pytest.fixture(scope="module")
def empty_history(tmp_path_factory):
    """A history as the daemon makes it at its first start, with one axis."""
    from monitor.store import Store
    from plant.axis_file import read_axis

    folder = tmp_path_factory.mktemp("history")
    store = Store(f"sqlite:///{folder / 'tribowatch.db'}")
    store.register([read_axis(write(folder / "axis.toml", AXIS))])
    store.close()
    return folder


PUBLISHER = """
import json, sys, time, zenoh
from plant.zenoh_session import open_session

def junk():
    yield b"", "application/cbor"
    yield b"\\xff\\x00garbage", "application/cbor"
    yield b"{not json", "application/json"
    yield b"[1, 2, 3]", "application/json"
    yield b"hello", "text/plain"
    good = {"v": 1, "axis": "axis-0001", "epoch": 1, "seq": 0, "t0_ns": 10**18, "dt_ns": 10**7,
            "torque": [1.0, 2.0], "position": [0.5, 0.5]}
    for change in ({"v": 99}, {"torque": [1.0]}, {"position": ["x", "y"]}, {"seq": -1}, {"dt_ns": 0}, {"surprise": 1},
                   {"axis": "../etc"}, {"torque": [1e999, 1.0]}):
        yield json.dumps(good | change).encode(), "application/json"
    yield b"\\x9f" * 200_000, "application/cbor"

with open_session("client", connect=[sys.argv[1]]) as session:
    publisher = session.declare_publisher(
        "tribowatch/test/axis-0001/samples", congestion_control=zenoh.CongestionControl.BLOCK
    )
    deadline = time.monotonic() + 10
    while not publisher.matching_status.matching and time.monotonic() < deadline:
        time.sleep(0.01)
    for payload, encoding in junk():
        publisher.put(payload, encoding=encoding)
    session.put("tribowatch/test/not an axis/samples", b"x")
    time.sleep(0.5)
"""


def test_a_publisher_that_sends_garbage_is_counted_and_harms_nobody(running, tmp_path):
    endpoint = f"unixsock-stream/{tmp_path / 'z.sock'}"
    done = subprocess.run([sys.executable, "-c", PUBLISHER, endpoint], cwd=ROOT, capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr

    def rejected():
        axes = json.loads(tribowatch("axes", "--config", running, "--json").stdout)["axes"]
        found = {axis["axis"]: axis["rejected"] for axis in axes}["axis-0001"]
        return found if sum(found.values()) >= 14 else None

    reasons = wait_until(rejected, 30)
    assert set(reasons) <= set(REASONS)
    assert {"bad_json", "bad_cbor", "unknown_encoding", "bad_version", "unknown_key", "bad_length"} <= set(reasons)
    log = (tmp_path / "daemon.log").read_text()
    assert "Traceback" not in log
    done = tribowatch("doctor", "--config", running)
    assert done.returncode == 0, done.stdout
    assert "the daemon takes its samples" in done.stdout
