"""`tribowatch demo`, whole: the alert comes and is explained, ends are clean, no process stays behind."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contracts.command import ROOT, complaint, tribowatch, write
from tests.contracts.conftest import wait_until

FAST = ("--speed", "432000")  # five days a second


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


def test_the_alert_comes_is_explained_and_a_second_demo_starts_anew(tmp_path):
    for _ in range(2):
        done = tribowatch("demo", "--until-alert", "--json", "--state-dir", tmp_path / "demo", *FAST, timeout=300)
        assert done.returncode == 0, done.stderr
        result = json.loads(done.stdout)
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
        assert result["parameters"]["coulomb_force"]["unit"] == "N"
        assert "WEAR" in done.stderr
    assert (tmp_path / "demo" / "previous" / "tribowatch.db").exists()

    history = tribowatch("history", result["axis"], "--state-dir", tmp_path / "demo", "--json")
    series = json.loads(history.stdout)["series"]["coulomb_force"]
    assert series["answers"] >= result["windows"]["identified"]
    alerts = json.loads(tribowatch("alerts", "--state-dir", tmp_path / "demo", "--json").stdout)
    assert [one["kind"] for one in alerts["alerts"]] == ["wear"]


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


def test_duration_ends_it(tmp_path):
    done = tribowatch("demo", "--duration", "4", "--json", "--state-dir", tmp_path / "demo", timeout=120)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["stopped_by"] == "duration"


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
