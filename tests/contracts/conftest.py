"""A simulated recording with its axis file, and a daemon in a process of its own."""

import contextlib
import json
import subprocess
import sys
import time

import pytest

from tests.contracts.command import ROOT, tribowatch, write_configuration


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """Folder with recording.csv and axis.toml of the simulated machine of the demo."""
    folder = tmp_path_factory.mktemp("recorded")
    done = tribowatch(
        "simulate", "--scenario", "wear", "--out", folder / "recording.csv", "--write-axis", folder / "axis.toml"
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="session")
def worn(tmp_path_factory):
    """Folder and JSON of a demo that ran until its alert, five days a second."""
    folder = tmp_path_factory.mktemp("worn") / "demo"
    arguments = ("--until-alert", "--json", "--speed", "432000", "--state-dir", folder)
    done = tribowatch("demo", *arguments, timeout=300)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout), done.stderr


@contextlib.contextmanager
def daemon(config):
    """`tribowatch run --config CONFIG`, up and watching; its log is in `daemon.log` beside the configuration."""
    log = config.parent / "daemon.log"
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "monitor", "run", "--config", str(config)], stdout=out, stderr=out, cwd=ROOT
        )
    try:
        wait_until(lambda: "watching" in log.read_text() or process.poll() is not None, 60)
        assert process.poll() is None, log.read_text()
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        process.wait(20)


def wait_until(condition, seconds):
    """Poll until `condition()` is true; fails after `seconds`."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f"did not happen within {seconds} s"
        time.sleep(0.05)
    return value


@pytest.fixture
def running(tmp_path):
    """A daemon in a scratch folder; gives its configuration file."""
    config = write_configuration(tmp_path)
    with daemon(config):
        yield config
