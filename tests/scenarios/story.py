"""The whole story in time-lapse through the real daemon: `make story`.

Healthy weeks, a spot on the rail begins to resist and grows, the daemon notices that its model no longer holds, locates
and names the defect by itself, the defect is promoted and trended, repaired, and every alarm is normal again. Process,
Zenoh, database, workers and command line are real; only time is short. Everything it leaves, logs too, is in var/story.
"""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from monitor.queries import Reader
from plant.publisher import SamplePublisher
from plant.scenario import Scenario
from plant.scenario_file import read_scenario
from tests.scenarios.harness import ROOT, SITE, START_NS, Ear, Plant, blocks_of, wait_for

DAY_NS = 86_400 * 10**9
FOLDER = ROOT / "var" / "story"
PATIENCE = 300.0  # s for one answer; a window takes a tenth of a second of a free core
AXIS = "axis-1"
ENOUGH = 5  # bursts with a mismatch, by which the daemon has begun to diagnose
HEALTHY, STEP, GROWING, REPAIRED = 40, 4, 56, 12  # bursts; of the growing defect every fourth of two a day


def bursts(scenario: Scenario) -> list[tuple[str, int]]:
    """Chapter and number of each burst: 20 days healthy, 112 days of a growing defect, then as new."""
    first = 60  # day 30: the defect begins
    chapters = [("healthy", k) for k in range(HEALTHY)]
    chapters += [("growing", first + STEP * k) for k in range(GROWING)]
    return chapters + [("repaired", HEALTHY + k) for k in range(REPAIRED)]


class Teller:
    """Sends bursts and says what the daemon makes of them."""

    def __init__(self, plant: Plant, ear: Ear, publisher: SamplePublisher, scenario: Scenario) -> None:
        self.plant, self.ear, self.publisher, self.scenario = plant, ear, publisher, scenario
        self.sent = self.told = self.half_days = 0
        self.promoted = False

    def send(self, number: int, step: int) -> None:
        recording = self.scenario.burst(number).recording
        torque = recording.force / self.scenario.axis.mechanics.gain
        begin = START_NS + self.half_days * DAY_NS // 2
        self.half_days += step
        for block in blocks_of(AXIS, self.publisher.epoch, self.publisher.next_seq, begin, torque, recording.position):
            self.publisher.put(block)
        self.sent += 1
        end = time.monotonic() + PATIENCE
        while not self.answered():
            if self.plant.process.poll() is not None or time.monotonic() > end:
                raise AssertionError(f"no answer to burst {self.sent}: {self.state()}")
            time.sleep(0.05)

    def answered(self) -> bool:
        """Whether the history has every answer; what is published may be said before one listens, or on a lost link."""
        with Reader(self.plant.url) as reader:
            axis = reader.axis(AXIS)
        return axis.windows >= self.sent and not axis.pending

    def state(self) -> str:
        """Where the daemon stands, for who has to find out why it does not answer."""
        with Reader(self.plant.url) as reader:
            axis = reader.axis(AXIS)
        ended = self.plant.process.poll()
        shown = {name: getattr(axis, name) for name in ("samples", "missing", "windows", "pending", "rejected")}
        heard, latest = len(self.ear.heard["parameters"]), self.ear.heard["status"][-1:]
        log = "\n".join(self.plant.log.splitlines()[-15:])
        how = "runs" if ended is None else f"ended with {ended}"
        return f"the daemon {how}; history: {shown}; {heard} answers heard; status: {latest}; its log ends:\n{log}"

    def listen(self, chapter: str) -> None:
        for one in self.ear.heard["alerts"][self.told :]:
            text = one["alert"]["text"] if one.get("alert") else ""
            print(
                f"[{chapter}, burst {self.sent}] {one['kind']}: {one['transition']['after']}  {text[:230]}", flush=True
            )
        self.told = len(self.ear.heard["alerts"])

    def diagnosis(self) -> dict | None:
        with Reader(self.plant.url) as reader:
            found = [one for one in reader.diagnoses(AXIS) if one["verdict"] == "explained"]
        return found[-1] if found else None

    def diagnosed(self) -> bool:
        with Reader(self.plant.url) as reader:
            return bool(reader.diagnoses(AXIS))

    def active(self) -> list[str]:
        with Reader(self.plant.url) as reader:
            return sorted(one["kind"] for one in reader.alerts(AXIS, active=True))

    def promote(self) -> None:
        done = self.command("axes", "promote", AXIS, "rail_defect")
        print(f"    $ tribowatch axes promote {AXIS} rail_defect  ->  version {done['version']}", flush=True)

        def remodelled() -> bool:
            return len(trend_of(self.plant)) > 0

        wait_for(remodelled, 600, "stored windows identified again")
        self.promoted = True

    def command(self, *words: str) -> dict:
        order = [sys.executable, "-m", "monitor", *words, "--config", str(self.plant.config), "--author", "Ada"]
        done = subprocess.run([*order, "--json"], capture_output=True, text=True, cwd=ROOT, timeout=120, check=True)
        return json.loads(done.stdout)


def trend_of(plant: Plant) -> list[float]:
    """The promoted effect's size over time; empty before it is known. [N]"""
    with Reader(plant.url) as reader:
        series = reader.history(AXIS)["series"]
    return [point["value"] for point in series.get("rail_defect.amplitude", {"points": []})["points"]]


def tell(folder: Path) -> None:
    """Run it; an assertion fails where the daemon does not do its part."""
    scenario = read_scenario("rail_defect")
    scenario = dataclasses.replace(scenario, axis=dataclasses.replace(scenario.axis, name=AXIS))
    begin = time.monotonic()
    settings = "[window]\nhop = 2000\n"
    with Plant(folder, settings=settings) as plant:
        plant.start()
        with plant.session() as session, SamplePublisher(session, SITE, AXIS) as publisher:
            ear = Ear(session, AXIS)
            teller = Teller(plant, ear, publisher, scenario)
            seen = 0
            for chapter, number in bursts(scenario):
                teller.send(number, STEP if chapter == "growing" else 1)
                teller.listen(chapter)
                if chapter == "healthy":
                    assert not teller.active(), "an alarm on a healthy axis"
                elif chapter == "growing" and not teller.promoted and "model_mismatch" in teller.active():
                    seen += 1
                    if seen < ENOUGH:
                        continue
                    wait_for(teller.diagnosed, 900, "the daemon's own diagnosis")
                    named = teller.diagnosis()
                    if named is not None:
                        amplitude = 0.5 * (number / 2 - 30)
                        print(
                            f"    named: {json.dumps(named['result']['effects'])} (truth: {amplitude:.1f} N at 1.22 m)"
                        )
                        teller.promote()
            for kind in teller.active():
                teller.command("alerts", "acknowledge", AXIS, kind)
            wait_for(lambda: not teller.active(), 60, "every alarm back to normal")
            heard = len(ear.heard["parameters"])
            ear.close()
        values = np.array(trend_of(plant))
    assert teller.promoted, "the daemon did not name the defect"
    print(f"trend of rail_defect.amplitude [N]: {np.round(values, 1).tolist()}")
    print(
        f"{teller.sent} bursts ({heard} answers heard), {time.monotonic() - begin:.0f} s: noticed, named, promoted, "
        "trended, repaired, normal"
    )


if __name__ == "__main__":
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    tell(FOLDER)
