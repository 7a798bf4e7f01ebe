"""The loop closed, in the corridor: a rail defect is noticed, diagnosed, named, promoted, trended, repaired."""

import numpy as np
import pytest

from monitor.errors import QueryError
from monitor.evidence import unpack
from monitor.evidence_replay import replay
from monitor.laboratory import Laboratory
from monitor.queries import Reader
from monitor.workers import Workers
from plant.scenario_file import read_scenario
from tests.monitor.studies.offline import samples_of
from tests.monitor.test_pipeline import Bench
from tests.scenarios.harness import START_NS, blocks_of, wait_for

DAY_NS = 86_400 * 10**9
SCENARIO = read_scenario("rail_defect")  # from day 30 on, two bursts a day; 40 N on day 110, at 1.22 m
SICK = 2 * 110


class Story:
    """Bursts of the scenario in any order, one a day."""

    def __init__(self, start):
        self.start, self.bench, self.day = start, start(), 0

    def restart(self):
        self.bench.store.close()
        self.bench = self.start()
        return self.bench

    def tell(self, numbers):
        for number in numbers:
            recording = SCENARIO.burst(number).recording
            samples = samples_of(recording, SCENARIO.axis, 0, 0)
            begin = START_NS + self.day * DAY_NS
            for block in blocks_of("axis-1", 1, 2000 * self.day, begin, samples.drive, samples.position, 500):
                self.bench.put(block)
            self.day += 1
        self.bench.finish(300)

    @property
    def run(self):
        return self.bench.pipeline.runs["axis-1"]

    @property
    def active(self):
        return {kind for kind, one in self.run.alarms.items() if one.alarm.active}

    def wait(self, condition, what):
        wait_for(lambda: self.bench.step(0.0) or condition(), 500, what)


@pytest.fixture
def story(tmp_path):
    workers = Workers(1)
    settings = {"window": {"samples": 2000, "hop": 2000}, "drift": {"baseline_windows": 8}}
    laboratory = Laboratory(600.0)
    yield Story(lambda: Bench(tmp_path, workers, laboratory=laboratory, **settings))
    laboratory.close()
    workers.close()


def test_a_rail_defect_from_its_first_newtons_to_its_repair(story):
    bench = story.bench
    story.tell(range(9))
    assert story.active == set()
    with pytest.raises(QueryError, match="is not known"):
        bench.order("promote", effect="rail_defcet")
    story.tell(range(SICK, SICK + 4))
    assert story.active == {"model_mismatch"}
    story.wait(lambda: bench.heard("mismatch"), "a diagnosis")
    found = bench.heard("mismatch")[0]
    assert (found["verdict"], found["promote"]) == ("explained", ["rail_defect"])
    assert "rail defect at 1.22 m, 40" in found["finding"]
    alert = story.run.alarms["model_mismatch"].alert
    assert found["finding"] in alert["text"]
    with Reader(bench.url) as reader:
        stored = reader.diagnoses("axis-1")
    assert len(stored) == 1
    assert len(stored[0]["windows"]) == 3

    bench = story.restart()
    assert story.run.mismatch.latest is not None
    assert story.run.mismatch.latest.result["effects"] == found["effects"]

    done = bench.order("promote", effect="rail_defect")
    assert (done["version"], done["effects"]) == (2, ["rail_defect"])
    story.wait(lambda: "rail_defect.amplitude" in (story.run.drift.baseline.extra if story.run.drift.baseline else ()),
               "stored windows seen by the new model")  # fmt: skip
    amplitudes = history(bench, "rail_defect.amplitude")
    assert len(amplitudes) >= 9
    assert np.abs(amplitudes[:8]).max() < 5 < 35 < amplitudes[-1] < 45
    story.tell(range(SICK + 4, SICK + 8))
    assert story.active == {"wear"}  # the mismatch is explained; what grew has a name
    assert story.run.alarms["wear"].alert["evidence"]["indicator"] == "rail_defect.amplitude"
    evidence_replays(bench)
    assert bench.heard("model")[-1]["effects"] == ["rail_defect"]
    assert 35 < bench.heard("model")[-1]["parameters"]["rail_defect.amplitude"]["value"] < 45

    story.tell(range(9, 15))  # repaired
    assert story.active == set()
    assert bench.order("demote", effect="rail_defect")["effects"] == []
    with Reader(bench.url) as reader:
        assert [one["why"] for one in reader.versions("axis-1")][1:] == ["promoted rail_defect", "demoted rail_defect"]
    with pytest.raises(QueryError, match="has no effect"):
        bench.order("demote", effect="rail_defect")


def evidence_replays(bench):
    """The bundle of the alert on a promoted effect gives the same verdict anew; without the effect other numbers."""
    with Reader(bench.url) as reader:
        kept = next(one for one in reader.evidence_list("axis-1") if one["kind"] == "wear")
        bundle = unpack(reader.evidence(kept["number"]))
    assert bundle.manifest["alert"]["evidence"]["indicator"] == "rail_defect.amplitude"
    told = replay(bundle)
    assert (told["same"], told["bit_for_bit"], told["differences"]) == (True, True, [])
    assert told["holding"]["now"] == ["wear"]
    bundle.manifest["axis"]["effects"] = {}
    assert not replay(bundle)["bit_for_bit"]


def history(bench, name):
    with Reader(bench.url) as reader:
        return [point["value"] for point in reader.history("axis-1", parameter=name)["series"][name]["points"]]
