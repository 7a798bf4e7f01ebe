"""`tribowatch demo`, whole: the alert comes and is explained, ends are clean, no process stays behind."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from monitor.demo_processes import AHEAD
from tests.contracts.command import ROOT, complaint, tribowatch, write
from tests.contracts.conftest import wait_until


def start(folder, *arguments):
    """A demo in the background, on a folder of its own; ^C reaches it even if the test runner ignores it."""
    program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); import monitor.__main__ as m; "
    return subprocess.Popen(
        [sys.executable, "-c", program + "m.main()", "demo", "--state-dir", folder, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )


def children(folder: Path):
    """Processes, other than workers of ours, that live in `folder`."""
    found = []
    for link in Path("/proc").glob("[0-9]*/cwd"):
        try:
            if link.resolve() == folder.resolve():
                found.append(int(link.parent.name))
        except OSError:  # it has just ended
            continue
    return found


needs_proc = pytest.mark.skipif(not Path("/proc/self/cwd").exists(), reason="needs /proc to look for orphans")


def test_the_alert_comes_and_is_explained(worn):
    folder, result, said = worn
    assert result["schema_version"] == 1
    assert result["stopped_by"] == "alert"
    alert = result["alerts"][-1]
    assert alert["kind"] == "wear"
    assert alert["evidence"]["relative_ci95"][0] > 0
    assert alert["likely_cause"]
    assert alert["recommended_action"]
    assert result["windows"]["identified"] >= 60
    assert result["figures"]["event_days"] > 30  # the guide begins to wear on day 30
    assert result["figures"]["missing"] == 0
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", result["page"])
    assert result["page"] in said
    assert result["parameters"]["coulomb_force"]["unit"] == "N"
    assert "WEAR" in said
    assert (folder / "daemon.log").exists()


def test_history_alerts_and_axes_tell_what_the_demo_told(worn):
    folder, result, _ = worn
    history = tribowatch("history", result["axis"], "--state-dir", folder, "--json")
    series = json.loads(history.stdout)["series"]["coulomb_force"]
    assert series["answers"] >= result["windows"]["identified"]
    assert series["points"][-1]["value"] > series["points"][0]["value"]
    alerts = json.loads(tribowatch("alerts", "--state-dir", folder, "--json").stdout)
    assert [one["kind"] for one in alerts["alerts"]] == ["wear"]
    assert alerts["transitions"][0]["transition"]["after"] == "unacknowledged"
    axes = json.loads(tribowatch("axes", "--state-dir", folder, "--json").stdout)["axes"]
    assert axes[0]["alarms"] == {"wear": "unacknowledged"}
    assert axes[0]["baseline"]["complete"]


def test_the_machine_does_not_outrun_what_is_identified(worn):
    folder, result, _ = worn
    axis = json.loads(tribowatch("axes", "--state-dir", folder, "--json").stdout)["axes"][0]
    begin = datetime(2026, 1, 5, 6, tzinfo=UTC).timestamp()  # of the scenario
    unanswered_days = (axis["last_sample_ns"] / 1e9 - begin) / 86400 - result["figures"]["event_days"]
    # two bursts a day, each of some seconds; the last ones come while the demo ends
    assert -0.1 < unanswered_days < (AHEAD + 2) / 2 + 0.01


def test_the_same_for_people(worn):
    folder, result, _ = worn
    assert "likely cause" in tribowatch("alerts", "--state-dir", folder).stdout
    shown = tribowatch("history", result["axis"], "--state-dir", folder, "--parameter", "coulomb_force").stdout
    assert "coulomb force" in shown
    assert "▁" in shown
    table = tribowatch("history", result["axis"], "--state-dir", folder, "--points", "10", "--csv").stdout.splitlines()
    assert table[0].startswith("time,parameter,unit,value,ci95_low,ci95_high")
    assert len([row for row in table if ",coulomb_force," in row]) <= 10
    assert result["axis"] in tribowatch("axes", "--state-dir", folder).stdout


def test_since_counts_back_from_the_latest_sample_not_from_today(worn):
    folder, result, _ = worn
    axis = json.loads(tribowatch("axes", "--state-dir", folder, "--json").stdout)["axes"][0]

    def stamps(*more):
        done = tribowatch("history", result["axis"], "--state-dir", folder, "--json", *more)
        return [point["t_ns"] for point in json.loads(done.stdout)["series"]["coulomb_force"]["points"]]

    everything = stamps()
    middle = everything[len(everything) // 2]
    seconds = (axis["last_sample_ns"] - middle) // 10**9 + 1
    assert stamps("--since", f"{seconds}s") == everything[len(everything) // 2 :]


def test_a_second_demo_starts_anew_and_keeps_the_first(worn, tmp_path):
    first, folder = worn[1], tmp_path / "demo"
    shutil.copytree(worn[0], folder)
    done = tribowatch("demo", "--duration", "3", "--json", "--state-dir", folder, timeout=120)
    assert done.returncode == 0, done.stderr
    second = json.loads(done.stdout)
    assert second["stopped_by"] == "duration"
    assert second["figures"]["samples"] < first["figures"]["samples"]
    axes = json.loads(tribowatch("axes", "--state-dir", folder / "previous", "--json").stdout)["axes"]
    assert axes[0]["samples"] >= first["figures"]["samples"]


@needs_proc
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_no_process_stays_behind_however_the_demo_ends(tmp_path, number, code):
    folder = tmp_path / "demo"
    process = start(folder, "--json")
    wait_until(lambda: len(children(folder)) >= 2, 60)
    wait_until(lambda: "watching" in (folder / "daemon.log").read_text(), 60)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == code, err
    wait_until(lambda: not children(folder), 30)
    assert "Traceback" not in err
    if number is signal.SIGINT:
        assert json.loads(out)["stopped_by"] == "interrupt"
    else:
        assert out == ""


def test_the_history_of_a_real_daemon_is_not_touched(tmp_path):
    database = write(tmp_path / "tribowatch.db", "precious")
    assert "real daemon" in complaint(tribowatch("demo", "--state-dir", tmp_path), 2)
    assert database.read_text() == "precious"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--speed", "0"], "--speed"),
        (["--duration", "-1"], "--duration"),
        (["--seed", "-1"], "--seed"),
        (["--scenario", "nonsense"], "nonsense"),
    ],
)
def test_options_that_cannot_be(tmp_path, arguments, word):
    assert word in complaint(tribowatch("demo", "--state-dir", tmp_path / "demo", *arguments), 2)
    assert not os.path.lexists(tmp_path / "demo" / "tribowatch.db")


def test_watch_prints_every_change_as_it_is_stored(worn, tmp_path):
    """A transition written while `alerts --watch` waits, by the store of the daemon itself."""
    folder = tmp_path / "demo"
    shutil.copytree(worn[0], folder)
    process = subprocess.Popen(
        [sys.executable, "-m", "monitor", "alerts", "--watch", "--json", "--state-dir", folder],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    try:
        assert "waiting" in process.stderr.readline()
        acknowledge(folder)
        change = json.loads(process.stdout.readline())
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=30)
    assert change["kind"] == "wear"
    assert change["transition"]["after"] == "acknowledged"
    assert change["transition"]["author"] == "a test"
    assert process.returncode == 143


def acknowledge(folder):
    """Acknowledge the wear alert as the daemon would at an operator's command."""
    from monitor.alarms import AlarmRule, Event
    from monitor.judgement import command
    from monitor.store import Store

    store = Store(f"sqlite:///{folder / 'tribowatch.db'}")
    axis = store.register([]).popitem()[1]
    record = store.alarms(axis.id)["wear"]
    now = record.alarm.since_ns + 10**9
    moved, change = command(record, Event.ACKNOWLEDGE, now, AlarmRule(), "a test")
    store.save_alarms(axis.id, [moved], [change])
    store.close()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")
def test_on_a_terminal_there_is_a_live_table(tmp_path):
    """A demo of three days on a pseudo terminal, to its end; a dumb one, so that only the last picture is drawn."""
    import pty

    scenario = (ROOT / "plant" / "scenarios" / "wear.toml").read_text()
    short = write(tmp_path / "short.toml", scenario.replace("days = 180.0", "days = 3.0"))

    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "monitor", "demo", "--scenario", short, "--state-dir", tmp_path / "demo"],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        cwd=ROOT,
        env=os.environ | {"TERM": "dumb", "COLUMNS": "100"},
    )
    os.close(theirs)
    shown = read_all(ours)
    assert process.wait(60) == 0
    assert "coulomb force" in shown
    assert "95 % interval" in shown
    assert re.search(r"the scenario is over\. [56] windows", shown)  # the first answer may come before we listen
    assert "Where to look next" in shown
    assert "one second here is up to 2 days of the machine" in shown


def read_all(terminal):
    """Everything the other side writes until it closes."""
    parts = []
    with contextlib.suppress(OSError):  # Linux says EIO at the end
        while part := os.read(terminal, 65536):
            parts.append(part)
    os.close(terminal)
    return b"".join(parts).decode()


def test_it_ends_when_the_machine_has_dropped_samples(tmp_path):
    """A dropped sample has no number: it is neither received nor missing, and must not be waited for."""
    text = (ROOT / "plant" / "scenarios" / "bad_sensor.toml").read_text(encoding="utf-8")
    text = text.replace("days = 60.0", "days = 1.0").replace("from_day = 40.0", "from_day = 0.0")
    faults = text.split("[[fault]]\n")
    kept = [faults[0], *(one for one in faults[1:] if "dropout_rate" in one or "[[ageing]]" in one)]
    scenario = write(tmp_path / "drops.toml", "[[fault]]\n".join(kept))
    done = tribowatch("demo", "--scenario", scenario, "--state-dir", tmp_path / "demo", "--json", timeout=120)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["stopped_by"] == "end"
    assert 0 < result["figures"]["samples"] < 4 * 2000
