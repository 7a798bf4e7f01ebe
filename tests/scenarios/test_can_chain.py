"""From frames to the alert: a CiA 402 drive on a bus, the bridge, Zenoh, the whole daemon. No hardware."""

import json
import random
import threading

import pytest

from monitor.queries import Reader
from plant import keys
from plant.bridge_can import run_bridge
from plant.bridge_file import read_bridge
from plant.bus_can import carries_frames
from plant.drive_can import play_scenario
from plant.errors import ReachError
from plant.scenario_file import read_scenario
from tests.contracts.command import ROOT, tribowatch, write
from tests.scenarios.harness import SITE, Ear, Plant, wait_for

SMALL = "[drift]\nbaseline_windows = 6\nbaseline_span = 0.0\n"
BURSTS = 13


def worn_scenario(folder):
    """Half a day between bursts; from day 4 on the guide wears fast."""
    text = (ROOT / "plant" / "scenarios" / "wear.toml").read_text()
    for known, ours in (("onset = 60.0", "onset = 8.0"), ("per_kilometre = 1.1667e-3", "per_kilometre = 0.1")):
        assert known in text
        text = text.replace(known, ours)
    return read_scenario(write(folder / "worn.toml", text))


def bridge_file(folder, endpoint, interface, channel, options=""):
    return write(
        folder / "bridge.toml",
        f'name = "b-1"\nsite = "{SITE}"\n[zenoh]\nconnect = ["{endpoint}"]\n[can]\ninterface = "{interface}"\n'
        f'channel = "{channel}"\nsilence = 60.0\n{options}\n[time]\norigin = "time_object"\n[block]\nstatus = 0.2\n'
        '[[axis]]\nname = "axis-0001"\nnode = 1\ncounts_per_unit = 1e5\nrated_torque = 8.0\n',
    )


def test_frames_on_a_bus_become_an_alert(tmp_path):
    scenario = worn_scenario(tmp_path)
    with Plant(tmp_path, axes=("axis-0001",), settings=SMALL) as plant:
        plant.start()
        settings = read_bridge(bridge_file(tmp_path, plant.endpoint, "virtual", str(tmp_path)))
        stop, result = threading.Event(), []
        with plant.session() as session, plant.session() as other:
            ear = Ear(other, "axis-0001")
            thread = threading.Thread(target=lambda: result.append(run_bridge(settings, session, stop=stop)))
            thread.start()
            try:
                wait_for(lambda: bridge_is_up(other), 30, "the bridge")
                play_scenario(scenario, settings, last=BURSTS)
                wait_for(lambda: sum(verdicts(plant).values()) >= BURSTS, 300, "an answer for every burst")
                alerts = wait_for(lambda: ask_alerts(other), 30, "an alert")
            finally:
                stop.set()
                thread.join()
            ear.close()
    counted = result[0]["axes"]["axis-0001"]
    assert (counted["sent"], counted["lost"], counted["filled"]) == (2000 * BURSTS, 0, 0)
    assert result[0]["frames"]["unknown"] == result[0]["frames"]["wrong_length"] == 0
    assert verdicts(plant) == {"identified": BURSTS}
    assert {one["verdict"] for one in ear.heard["parameters"]} == {"identified"}
    assert [alert["kind"] for alert in alerts] == ["wear"]
    assert ear.heard["status"][-1]["missing"] == 0


def verdicts(plant):
    """Of all windows that are kept: what is heard alone may come before the link."""
    with Reader(plant.url) as reader:
        return reader.axis("axis-0001").verdicts


def ask_alerts(session):
    """Asked for, not only heard: the first message on a key may come before the link."""
    (reply,) = session.get(keys.history_key(SITE, "axis-0001", "alerts") + "?active", timeout=10.0)
    return json.loads(reply.ok.payload.to_bytes())["alerts"]


def bridge_is_up(session):
    return any(reply.ok for reply in session.liveliness().get(f"tribowatch/{SITE}/alive/b-1", timeout=1.0))


def test_the_demo_over_can_runs_from_the_drive_to_the_answers(tmp_path):
    """Four processes: drive, bridge, daemon, demo. Skipped where multicast does not come back to this computer."""
    needs_multicast()
    scenario = (ROOT / "plant" / "scenarios" / "wear.toml").read_text()
    short = write(tmp_path / "short.toml", scenario.replace("days = 180.0", "days = 1.5"))
    folder = tmp_path / "demo"
    done = tribowatch("demo", "--can", "--scenario", short, "--state-dir", folder, "--json", timeout=200)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert (result["stopped_by"], result["windows"]) == ("end", {"total": 3, "identified": 3})
    assert (result["figures"]["samples"], result["figures"]["missing"]) == (6000, 0)
    assert result["parameters"]["coulomb_force"]["value"] > 0
    said = (folder / "bridge.log").read_text()
    assert "axis-0001: drive is in state 'operation enabled'" in said
    assert "Traceback" not in said
    assert "CAN" in done.stderr


def needs_multicast():
    """Skip where a datagram to the group does not come back."""
    options = {"port": random.SystemRandom().randrange(40_000, 50_000), "hop_limit": 0}
    try:
        carried = carries_frames("udp_multicast", "239.74.163.2", options)
    except ReachError as error:
        pytest.skip(f"no multicast here: {error}")
    if not carried:
        pytest.skip("multicast does not come back to this computer")
