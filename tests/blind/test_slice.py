"""A slice of the blind study, and the scoring on answers made by hand."""

import json

import pytest

from tests.blind.__main__ import run, write_report
from tests.blind.diagnosing import ask, locked
from tests.blind.plan import KINDS, draw_spec
from tests.blind.scoring import score
from tests.blind.sealing import Study, seal
from tests.blind.tables import rate, report, wilson
from tests.reference.cases import CaseSpec, draw_case, write_case

SPEC = {"size": 0.5, "excitation": "loop_sine", "noise": 1e-4, "period": 0.01, "orientation": "vertical",
        "shapes": "catalogue"}  # fmt: skip


def label(kind, effects=None, outside=None, shapes=None):
    return {"kind": kind, "spec": SPEC, "effects": effects or {}, "outside": outside, "shapes": shapes or {}}


def reply(verdict, effects=None, alternatives=(), location=None, fit=(1.0, 0.2)):
    found = [{"name": name, "parameters": {key: {"value": value, "ci95": ci} for key, (value, ci) in values.items()}}
             for name, values in (effects or {}).items()]  # fmt: skip
    both = {
        name: {"train": value, "held_out": value} for name, value in zip(("baseline", "extended"), fit, strict=True)
    }
    answer = {"verdict": verdict, "effects": found, "alternatives": alternatives, "location": location, "fit": both}
    return {"answer": answer, "seconds": 1.0, "cpu": 1.0}


def scored(*arguments):
    return score("case-0000", *arguments)


LAG, GAP = {"actuator_lag": {"time_constant": 0.02}}, {"backlash": {"gap": 1e-3}}
SAID_LAG = {"actuator_lag": {"time_constant": (0.021, [0.018, 0.024])}}
SAID_GAP = {"backlash": {"gap": (2e-3, [1.5e-3, 2.5e-3])}}


@pytest.mark.parametrize(
    ("kind", "truth", "answer", "outcome", "false_name"),
    [
        ("single", LAG, reply("explained", SAID_LAG), "right", False),
        ("single", LAG, reply("explained", SAID_GAP, [["backlash"], ["actuator_lag"]]), "accepted", False),
        ("single", LAG, reply("explained", SAID_GAP, [["backlash"]]), "wrong", True),
        ("single", LAG, reply("explained", SAID_GAP | SAID_LAG), "extra", True),
        ("single", LAG, reply("no_mismatch"), "abstained", False),
        ("single", LAG, reply("unexplained"), "unexplained", False),
        ("single", LAG, {"answer": None, "seconds": 9.0, "cpu": 9.0}, "failed", False),
        ("pair", LAG | GAP, reply("explained", SAID_GAP | SAID_LAG), "both", False),
        ("pair", LAG | GAP, reply("explained", SAID_GAP), "one", False),
        ("pair", LAG | GAP, reply("explained", SAID_GAP | {"rail_defect": {}}), "one_and_wrong", True),
        ("pair", LAG | GAP, reply("explained", {"rail_defect": {}}), "wrong", True),
        ("smooth", {}, reply("no_mismatch"), "as_expected", False),
        ("rough", {}, reply("explained", SAID_GAP), "wrong", True),
        ("rough", {}, reply("unexplained"), "unexplained", False),
        ("still", LAG, reply("insufficient_data"), "as_expected", False),
        ("still", LAG, reply("explained", SAID_LAG), "wrong", True),
    ],
)
def test_an_answer_is_worth_what_it_says(kind, truth, answer, outcome, false_name):
    got = scored(label(kind, truth), answer)
    assert (got.outcome, got.false_name) == (outcome, false_name)
    assert got.good == (outcome in ("right", "accepted", "both", "as_expected"))


def test_severity_is_measured_where_the_name_is_right_and_drawn_where_not():
    assert scored(label("single", LAG), reply("explained", SAID_LAG, fit=(1.0, 0.05))).severity == "strong"
    assert scored(label("single", LAG), reply("explained", SAID_LAG, fit=(1.0, 0.6))).severity == "faint"
    assert scored(label("single", LAG), reply("explained", SAID_GAP, fit=(1.0, 0.05))).severity == "faint"


def test_parameters_are_judged_with_their_intervals_and_foreign_curves_without():
    right = scored(label("single", LAG), reply("explained", SAID_LAG))
    assert right.covered == [("actuator_lag.time_constant", True)]
    assert right.errors[0][1] == pytest.approx(0.05)
    assert scored(label("single", GAP), reply("explained", SAID_GAP)).covered == [("backlash.gap", False)]
    assert scored(label("single", GAP, shapes={"backlash": "other"}), reply("explained", SAID_GAP)).covered == []
    assert scored(label("single", LAG), reply("explained", SAID_GAP)).errors == []


def test_a_place_counts_with_its_coordinate_and_its_interval():
    outside = {"name": "outer_pulse", "coordinates": ["time"], "interval": [5.0, 9.0]}
    for coordinate, more, interval, located, first, right in [
        ("time", [], [5.5, 8.0], True, True, True),
        ("time", [], [0.0, 30.0], True, True, False),
        ("position", ["time"], [5.5, 8.0], True, False, False),
        ("position", [], [5.5, 8.0], False, False, False),
    ]:
        place = {"coordinate": coordinate, "interval": interval, "alternatives": more}
        got = scored(label("outside", outside=outside), reply("unexplained", location=place))
        assert (got.located, got.located_first, got.interval) == (located, first, right)
    tone = {"name": "outer_sine", "coordinates": ["frequency", "time"], "interval": [1.5, 1.5]}
    place = {"coordinate": "frequency", "interval": [1.4, 1.6]}
    assert scored(label("outside", outside=tone), reply("unexplained", location=place)).interval
    assert scored(label("outside", outside=tone), reply("no_mismatch")).located is False


def test_wilson_intervals_and_the_report():
    assert wilson(0, 60) == pytest.approx((0.0, 0.0602), abs=1e-3)
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)
    assert "50.0%" in rate("x", [True, False])
    text = report([scored(label("single", LAG), reply("explained", SAID_GAP)),
                   scored(label("pair", LAG | GAP), reply("explained", SAID_GAP))])  # fmt: skip
    assert "true actuator_lag; said backlash" in text
    assert "at least one                                 100.0%" in text


def test_a_study_draws_every_kind_and_its_seeds_do_not_meet():
    drawn = [draw_spec(5, index) for index in range(200)]
    assert {kind for kind, _ in drawn} == set(KINDS)
    assert {spec.orientation for _, spec in drawn} == {"vertical", "horizontal", "rotary"}
    assert len({spec.seed for _, spec in drawn}) == 200
    assert drawn == [draw_spec(5, index) for index in range(200)]


def test_labels_are_sealed_first_and_the_folders_do_not_tell(tmp_path):
    study = Study(20, 2, tmp_path, duration=8.0)
    first = seal(study, range(2))
    assert seal(study, range(2)) == first
    labels = json.loads(study.labels(range(2)).read_text())
    with locked(tmp_path / "sealed"):
        assert (tmp_path / "sealed").stat().st_mode & 0o777 == 0
    for index in range(2):
        files = {file.name for file in study.case(index).iterdir()}
        assert files <= {"axis.toml", "recording_1.csv", "recording_2.csv"}
        text = (study.case(index) / "axis.toml").read_text()
        assert f'name = "case-{index:04d}"' in text
        assert not any(name in text for name in labels[f"case-{index:04d}"]["effects"])


@pytest.mark.parametrize("seed", [31, 32])
def test_nothing_hidden_gets_no_name(tmp_path, seed):
    spec = CaseSpec(seed, excitation="loop_scurve" if seed == 31 else "multisine", duration=12.0)
    write_case(draw_case(spec), tmp_path / "case")
    found = ask(tmp_path / "case", 200.0)
    assert found["exit"] == 0, found["stderr"]
    assert found["answer"]["effects"] == []


def test_a_study_runs_is_resumed_and_reports(tmp_path):
    study = Study(12, 2, tmp_path, duration=12.0)
    run(study, 1, 200.0, float("inf"), 2)
    answers = [study.answer(index) for index in range(2)]
    assert all(path.exists() for path in answers)
    stamps = [path.stat().st_mtime_ns for path in answers]
    run(study, 1, 200.0, float("inf"), 2)
    assert [path.stat().st_mtime_ns for path in answers] == stamps
    assert write_report(study, 2).startswith("2 cases scored")
    assert not any(path.name.endswith(".part") for path in (tmp_path / "answers").iterdir())
    assert len(json.loads((tmp_path / "scores.json").read_text())) == 2
