"""`bridge`, `record`, `check-config` of a bridge file and `replay` of several axes, on the command line."""

import copy
import json
import threading

import numpy as np
import pytest

from monitor.bridge_news import news
from monitor.cli.app import run_command
from monitor.doctor_bridge import check_bridge
from plant import keys
from plant.axis import Axis, Mechanics, Orientation
from plant.axis_file import write_axis
from plant.recording import Recording
from plant.recording_files import write_recording
from plant.zenoh_session import open_session
from tests.monitor.committing import committing

DRIVE = '[[axis]]\nname = "axis-1"\nnode = 1\ncounts_per_unit = 1e6\nrated_torque = 8.0\n'


@pytest.fixture
def folder(tmp_path):
    text = f'name = "b-1"\nsite = "s"\n[can]\ninterface = "virtual"\nchannel = "{tmp_path}"\n{DRIVE}'
    (tmp_path / "bridge.toml").write_text(text)
    return tmp_path


@pytest.fixture
def hub(folder):
    endpoint = f"unixsock-stream/{folder}/z.sock"
    with open_session("peer", listen=[endpoint]) as session:
        yield endpoint, session


def run(*words):
    return run_command([str(word) for word in words])


def test_check_config_shows_what_every_bit_means(folder, capsys):
    assert run("check-config", folder / "bridge.toml", "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    (axis,) = summary["axes"]
    assert (axis["samples_key"], summary["status_key"]) == ("tribowatch/s/axis-1/samples", "tribowatch/s/b-1/bridge")
    torque = axis["frames"][0]["signals"][2]
    assert (torque["channel"], torque["start_bit"], torque["bits"]) == ("torque", 48, 16)
    assert torque["scale"] == pytest.approx(0.008)
    assert run("check-config", folder / "bridge.toml") == 0
    assert "6077h torque actual value" in capsys.readouterr().out


def test_a_bridge_file_with_a_wrong_width_is_exit_2(folder, capsys):
    path = folder / "bridge.toml"
    path.write_text(path.read_text() + 'pdo = [{ objects = ["6041:16", "6064:16", "6077:16"] }]\n')
    for command in (("check-config", path), ("bridge", "--config", path)):
        assert run(*command) == 2
        said = capsys.readouterr()
        assert "6064h (position actual value) has 32 bits" in said.err
        assert (said.out, said.err.count("\n")) == ("", 1)


def test_a_bridge_on_a_silent_bus_ends_with_its_counters(folder, hub, capsys):
    assert run("bridge", "--config", folder / "bridge.toml", "--connect", hub[0], "--duration", "0.3", "--json") == 0
    said = capsys.readouterr()
    status = json.loads(said.out)
    assert (status["bridge"], status["frames"]["frames"], status["axes"]["axis-1"]["sent"]) == ("b-1", 0, 0)
    assert f"b-1: virtual {folder} to {hub[0]}" in said.err
    assert run("bridge", "--config", folder / "bridge.toml", "--connect", hub[0], "--duration", "0.3") == 0
    assert "no frames yet" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (('interface = "virtual"', 'interface = "nonsense"'), 2, "nonsense"),
        (('interface = "virtual"', 'interface = "socketcan"'), 3, "cannot be opened"),
        (("node = 1", "node = 0"), 2, "node of axis-1 is 0"),
    ],
)
def test_a_bus_that_cannot_be_is_one_line(folder, hub, change, code, words, capsys):
    path = folder / "bridge.toml"
    path.write_text(path.read_text().replace(*change))
    assert run("bridge", "--config", path, "--connect", hub[0], "--duration", "1") == code
    said = capsys.readouterr()
    assert words in said.err
    assert said.out == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("bridge", "--config", "none.toml"), "none.toml"),
        (("bridge", "--config", "bridge.toml", "--duration", "0"), "--duration is 0 s"),
        (("record", "--out", "out", "--format", "xls"), "format is xls"),
        (("record", "--out", "out", "--roll-minutes", "0"), "minutes is 0 min"),
        (("record", "--out", "out", "--duration", "-1"), "--duration is -1 s"),
        (("simulate", "--scenario", "wear", "--can", "bridge.toml", "--publish"), "one of --out RECORDING"),
        (("simulate", "--scenario", "wear", "--can", "bridge.toml"), "does not list axis 'axis-0001'"),
    ],
)
def test_bad_options_are_one_line(folder, words, said, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert run(*words) == 2
    printed = capsys.readouterr()
    assert said in printed.err
    assert (printed.out, printed.err.count("\n")) == ("", 1)


def test_record_says_what_it_wrote(folder, hub, capsys):
    assert run("record", "--out", folder / "out", "--connect", hub[0], "--duration", "0.2", "--json") == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["samples"] == 0
    assert "tribowatch/plant-1/*/samples" in said.err


# --- replay of several axes ---------------------------------------------------------------------------------------


@pytest.fixture
def axes(folder):
    t = 0.01 * np.arange(250)
    for number in (1, 2):
        axis = Axis(f"x-{number}", Mechanics(Orientation.HORIZONTAL, M=5.0, force_per_torque=4.0))
        write_axis(axis, folder / f"x-{number}.toml")
        write_recording(Recording(t, np.sin(number * t), np.cos(t)), folder / f"r-{number}.csv", axis)
    return ["--axis", folder / "x-1.toml", "--axis", folder / "x-2.toml"]


def test_several_axes_are_replayed_at_once(folder, hub, axes, capsys):
    endpoint, session = hub
    recordings = [f"x-1={folder}/r-1.csv", f"x-2={folder}/r-2.csv", f"x-2={folder}/r-2.csv"]
    with committing(session) as blocks:
        assert run("replay", *recordings, *axes, "--speed", "max", "--connect", endpoint, "--json") == 0
    result = json.loads(capsys.readouterr().out)["axes"]
    assert [(one["axis"], one["samples"], one["acknowledged"]) for one in result] == [
        ("x-1", 250, True),
        ("x-2", 500, True),
    ]
    for name, seqs in (("x-1", [0, 100, 200]), ("x-2", [0, 100, 200, 250, 350, 450])):
        assert [block.seq for block in blocks if block.axis == name] == seqs


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["r-1.csv"], "does not say of which axis: write AXIS=RECORDING, with one of x-1, x-2"),
        (["x-3=r-1.csv"], "with one of x-1, x-2"),
        (["x-1=r-1.csv", "x-2=r-2.csv", "--start", "original"], "does not say when it was made"),
        (["x-1=r-1.csv", "x-2=none.csv"], "none.csv"),
        (["--axis", "x-1.toml"], "'x-1' is given twice"),
    ],
)
def test_recordings_of_no_axis_are_one_line(folder, hub, axes, words, said, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert run("replay", *words, *axes, "--connect", hub[0]) == 2
    printed = capsys.readouterr()
    assert said in printed.err
    assert (printed.out, printed.err.count("\n")) == ("", 1)


# --- what is new --------------------------------------------------------------------------------------------------

QUIET = {
    "bus": {"interface": "virtual", "channel": "x", "state": "active", "last_error": None},
    "frames": {"errors": 0, "bus_off": 0, "wrong_length": 0, "unknown_ids": {}},
    "clock": {"syncs_lost": 0, "steps": 0, "offset": 0.0},
    "axes": {
        "a": {
            "refused": None, "suspicion": None, "state": "operation enabled", "nmt": "operational", "lost": 0,
            "boot_ups": 0, "emergencies": 0, "last_emergency": None,
        }
    },
}  # fmt: skip


def test_what_goes_on_as_before_is_no_news():
    assert news(QUIET, copy.deepcopy(QUIET)) == []


def test_every_change_is_one_line():
    now = copy.deepcopy(QUIET)
    now["bus"] |= {"state": "lost", "last_error": "unplugged"}
    now["frames"] |= {"errors": 3, "bus_off": 1, "unknown_ids": {"0x7DF": 4}}
    now["clock"] |= {"syncs_lost": 2}
    now["axes"]["a"] |= {"state": "fault", "lost": 30, "emergencies": 5000, "last_emergency": "0x8611: following error"}
    said = news(QUIET, now)
    assert len(said) == 8
    text = "\n".join(said)
    for words in (
        "lost: unplugged",
        "3 error frames",
        "restart-ms",
        "0x7DF",
        "2 SYNCs lost",
        "'fault'",
        "30 samples lost",
    ):
        assert words in text
    assert "5000 emergency messages, 0x8611: following error" in text


def test_doctor_looks_at_a_bridge_file_its_bus_and_the_bridge_at_work(folder, hub):
    endpoint, session = hub
    path = folder / "bridge.toml"
    path.write_text(path.read_text() + f'[zenoh]\nconnect = ["{endpoint}"]\n')
    said = {"name": "b-1", "seconds": 5.0, "bus": {"state": "active"}, "axes": {"axis-1": {"sent": 700, "lost": 0}}}
    key = keys.bridge_key("s", "b-1")

    def look(status):
        """What doctor says while a bridge tells `status` of itself."""
        done = threading.Event()

        def tell():
            while not done.wait(0.05):
                session.put(key, json.dumps(status))

        bridge = threading.Thread(target=tell)
        bridge.start()
        try:
            return {one.name: (one.outcome.value, one.finding) for one in check_bridge(path)}
        finally:
            done.set()
            bridge.join()

    found = look(said)
    assert found["bridge file"] == ("ok", "1 axes on virtual")
    assert found["bus"][0] == "warning"
    assert found["bridge b-1"] == ("ok", "at work for 5 s, bus active, 700 samples sent, 0 lost")
    found = look(said | {"axes": {"axis-1": {"refused": "two 16 bit values stand there"}}})
    assert found["bridge b-1"] == ("warning", "axis-1: two 16 bit values stand there")
    assert look(said | {"axes": {"axis-1": 3}})["bridge b-1"][0] == "warning"


def test_doctor_ends_with_2_at_a_bad_bridge_file_and_with_3_where_nobody_answers(folder, monkeypatch, capsys):
    monkeypatch.setattr("monitor.doctor_bridge.LINK_TIMEOUT", 0.2)
    path = folder / "bridge.toml"
    path.write_text(path.read_text() + f'[zenoh]\nconnect = ["unixsock-stream/{folder}/nobody.sock"]\n')
    assert run("doctor", "--bridge", path) == 3
    assert "bridge to daemon" in capsys.readouterr().out
    path.write_text("name = 3\n")
    assert run("doctor", "--bridge", path, "--json") == 2
    checks = json.loads(capsys.readouterr().out)["checks"]
    assert "name is missing or no text" in checks[-1]["finding"]
