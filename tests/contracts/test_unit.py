"""The systemd units: understood by systemd, well closed, and true to what daemon and bridge do."""

import configparser
import os
import re
import shutil
import socket
import subprocess

import pytest

from tests.scenarios.harness import ROOT, Plant, wait_for

UNITS = [ROOT / "deploy" / "tribowatch.service", ROOT / "deploy" / "tribowatch-bridge.service"]
UNIT = UNITS[0]
EXPOSURE = 2.5  # of 10, systemd-analyze's score; below 2.5 it says OK
analyze = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")


@analyze
@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_systemd_understands_the_unit(unit, tmp_path):
    text = unit.read_text().replace("/opt/tribowatch/.venv/bin/tribowatch", "/bin/true")
    copy = tmp_path / unit.name
    copy.write_text(text)
    done = subprocess.run(["systemd-analyze", "verify", copy], capture_output=True, text=True)
    about_us = [line for line in (done.stdout + done.stderr).splitlines() if "tribowatch" in line]
    assert not about_us


@analyze
@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_the_unit_is_closed(unit):
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", unit], capture_output=True, text=True, env=os.environ
    )
    score = re.search(rf"Overall exposure level for {unit.name}: ([\d.]+)", done.stdout)
    if score is None:
        pytest.skip(f"this systemd cannot judge a file: {done.stderr.strip()[:100]}")
    assert float(score[1]) < EXPOSURE


def service_of(unit):
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str
    parser.read_string(unit.read_text())
    return parser["Service"]


@pytest.mark.parametrize(("unit", "kind"), list(zip(UNITS, ("notify", "exec"), strict=True)), ids=["daemon", "bridge"])
def test_the_unit_says_what_the_program_does(unit, kind):
    service = service_of(unit)
    assert service["Type"] == kind
    assert service["SuccessExitStatus"] == "143"
    assert service["RestartPreventExitStatus"] == "2"
    assert service["ProtectSystem"] == "strict"
    assert service["DynamicUser"] == "yes"


def test_the_bridge_may_open_a_can_socket():
    assert "AF_CAN" in service_of(UNITS[1])["RestrictAddressFamilies"].split()


def test_the_daemon_tells_systemd_ready_beats_and_stopping(tmp_path, monkeypatch):
    path = tmp_path / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear, Plant(tmp_path) as plant:
        ear.bind(str(path))
        ear.setblocking(False)
        heard = []

        def hear(word):
            try:
                while True:
                    heard.append(ear.recv(4096).decode())
            except BlockingIOError:
                return any(word in one for one in heard)

        monkeypatch.setenv("NOTIFY_SOCKET", str(path))
        monkeypatch.setenv("WATCHDOG_USEC", "1000000")
        plant.launch()
        wait_for(lambda: hear("READY=1"), 60, "ready")
        heard.clear()
        wait_for(lambda: hear("WATCHDOG=1") and len(heard) >= 2, 30, "beats")
        assert any("watching 1 axes" in one or "watching 1 axis" in one for one in heard)
        plant.terminate()
        wait_for(lambda: hear("STOPPING=1"), 10, "stopping")
