"""A slice of the blind study, and the scoring on answers made by hand."""

import json
import math
from dataclasses import replace

import pytest

from plant.effects import CATALOGUE
from tests.blind import foreign
from tests.blind.__main__ import run, write_report
from tests.blind.diagnosing import ask, ask_rivals, locked
from tests.blind.frozen import digest, thresholds
from tests.blind.plan import KINDS, draw_spec
from tests.blind.rivals import METHODS, answers
from tests.blind.scoring import score
from tests.blind.sealing import Study, seal
from tests.blind.tables import Rate, sections, wilson
from tests.blind.truth import beside, criterion, without
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


def test_severity_is_the_baseline_against_the_true_machine_whatever_was_answered():
    for true, severity in ((0.9, "hidden"), (0.5, "faint"), (0.2, "clear"), (0.05, "strong")):
        known = label("single", LAG) | {"true_criterion": true}
        assert scored(known, reply("explained", SAID_LAG)).severity == severity
        assert scored(known, reply("explained", SAID_GAP)).severity == severity
    assert scored(label("single", LAG), reply("no_mismatch", fit=(1.0, 1.0))).severity == "faint"  # by its size
    found = scored(label("single", LAG) | {"true_criterion": 0.1}, reply("explained", SAID_LAG, fit=(1.0, 0.12)))
    assert found.over_true == pytest.approx(1.2)
    assert 0.9 < found.gained < 1.0


def test_rivals_are_scored_like_us_and_places_over_the_travel():
    theirs = {"rivals": {"a": {"sets": [["dead_time"], ["actuator_lag"]]}, "b": {"sets": [["backlash"]]},
                         "c": {"sets": []}, "d": {"sets": None}}}  # fmt: skip
    found = scored(label("single", LAG), reply("explained", SAID_LAG), theirs).rivals
    assert [found[m]["outcome"] for m in "abcd"] == ["accepted", "wrong", "abstained", "failed"]
    assert [found[m]["first"] for m in "abcd"] == [True, False, False, False]
    nothing = scored(label("smooth"), reply("no_mismatch"), theirs).rivals
    assert [nothing[m]["false_name"] for m in "abcd"] == [True, True, False, False]
    rail = {"rail_defect": {"centre": 0.10, "width": 0.01}}
    said = reply("explained", {"rail_defect": {"centre": (0.102, None), "width": (0.01, None)}})
    assert scored(label("single", rail) | {"travel": 0.4}, said).places == [
        ("rail_defect.centre", pytest.approx(0.005))
    ]


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
    assert "50.0%" in Rate.of("x", [True, False]).words
    theirs = {"rivals": {"force regression": {"sets": [["backlash"]]}}}
    found = sections([scored(label("single", LAG), reply("explained", SAID_GAP), theirs),
                      scored(label("pair", LAG | GAP), reply("explained", SAID_GAP), theirs)])  # fmt: skip
    text = "\n".join(section.markdown() for section in found)
    assert "true actuator_lag; said backlash" in text
    assert "| - at least one | 100.0%" in text
    assert "| pairs: at least one | 100.0% [21%, 100%] 1/1 | 100.0% [21%, 100%] 1/1 |" in text
    assert json.dumps([section.to_dict() for section in found])


def test_thresholds_are_frozen_by_a_digest(tmp_path):
    found = thresholds()
    names = {name.split(".")[1] for name in found}
    assert {"BIC", "Z", "TIED_SHARE", "NEEDED"} <= names  # wherever the rules stand
    assert found["experiment.NEEDED"] == "90.0"
    assert not any("COORDINATE" in name or "PLAIN" in name for name in found)
    (tmp_path / "one.py").write_text("A = 1.0\nB, C = 2, 3\nTEXT = 'x'\n")
    assert thresholds(tmp_path) == {"one.A": "1.0", "one.B": "2", "one.C": "3"}
    assert len(digest()) == 16


@pytest.mark.parametrize(("effects", "excitation"), [((), "sine"), (("dead_time",), "loop_cycle")])
def test_the_true_machine_predicts_what_it_did(effects, excitation):
    """Without noise and dirt next to nothing is left; without its effect, or with another friction, much more."""
    spec = CaseSpec(8304, effects, excitation=excitation, duration=8.0, dirt=0.0, noise=1e-7, artefacts="clean")
    case = draw_case(spec)
    bare = replace(case.plant, effects={}, coulomb_force=1.1 * case.plant.coulomb_force)
    own = criterion(case)
    assert own < 2e-5
    assert criterion(replace(case, plant=bare)) > 10 * own


def test_how_well_each_of_a_pair_shows_beside_the_other():
    """A stop that is never reached hides behind anything; a spring that friction cannot imitate does not."""
    spec = CaseSpec(8306, ("position_spring",), excitation="loop_cycle", size=1.4, duration=12.0, noise=1e-5)
    case = draw_case(spec)
    stop = {"position": 9.0, "stiffness": 1e4, "side": 1.0}
    shows = beside(replace(case, plant=replace(case.plant, effects=case.plant.effects | {"end_stop": stop})))
    assert shows["end_stop"] == pytest.approx(1.0)
    assert shows["position_spring"] > 10


def test_an_effect_without_which_there_is_no_machine_shows():
    case = draw_case(CaseSpec(9411, effects=("inertia_error", "transmission_compliance"), duration=5.0))
    error = {"mass_error": case.plant.M + case.plant.effects["inertia_error"]["mass_error"]}
    plant = replace(case.plant, M=0.0, effects=case.plant.effects | {"inertia_error": error})
    assert without(replace(case, plant=plant), "inertia_error", math.inf) == math.inf
    assert without(case, "inertia_error", math.inf) < math.inf


def test_a_pair_is_as_hard_as_its_lesser_effect():
    both = label("pair", LAG | GAP) | {"true_criterion": 0.01}
    found = scored(both | {"beside": {"actuator_lag": 90.0, "backlash": 1.1}}, reply("explained", SAID_LAG))
    assert (found.severity, found.lesser) == ("strong", "hidden")
    assert scored(both, reply("explained", SAID_LAG)).lesser == ""
    rows = {name: rates for section in sections([found]) for name, rates in section.rows}
    assert rows["- both, where each is clear beside the other"][0].total == 0


def test_rival_methods_answer_a_plain_case(tmp_path):
    """A spring under a large motion is found by a regression at least; all give sets of names from the catalogue."""
    spec = CaseSpec(8305, ("position_spring",), excitation="two_squares", size=1.4, duration=8.0, noise=1e-5)
    write_case(draw_case(spec), tmp_path / "case")
    found = answers(tmp_path / "case")
    assert set(found) == set(METHODS)
    assert any("position_spring" in names for names in found["force regression + BIC"]["sets"])
    for method, said in found.items():
        if said["sets"] is None:
            assert method == "sparse regression"  # pysindy is an extra
            assert "pysindy" in said["error"]
        else:
            assert all(set(names) <= set(CATALOGUE) for names in said["sets"])


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
    assert "2 cases scored" in write_report(study, 2)
    assert json.loads((tmp_path / "report.json").read_text())["cases"] == 2
    said = ask_rivals(study.case(0), 200.0)
    assert said["exit"] == 0, said["stderr"]
    assert set(said["rivals"]) == set(METHODS)
    assert "sha256" in (tmp_path / "report.md").read_text()
    assert not any(path.name.endswith(".part") for path in (tmp_path / "answers").iterdir())
    assert len(json.loads((tmp_path / "scores.json").read_text())) == 2


def test_a_process_that_takes_too_long_is_stopped_and_says_so(tmp_path, monkeypatch):
    (tmp_path / "case").mkdir()
    monkeypatch.setattr("tests.blind.diagnosing.COMMAND", ("-c", "while True: pass"))
    found = ask(tmp_path / "case", 0.3)
    assert (found["exit"], found["answer"]) == (None, None)
    assert "stopped after 0.3 s of CPU" in found["stderr"]
    assert 0.2 < found["cpu"] < 20.0


def test_cases_of_a_foreign_author_are_scored_by_his_own_labels(tmp_path):
    """`author.md` says what a label holds; what it asks for is all that scoring needs, the file being locked before."""
    folder, out = tmp_path / "BD", tmp_path / "out"
    lost = {"name": "fan", "coordinates": ["velocity", "direction"]}
    labels = {
        "case-0000": {"kind": "single", "effects": {"actuator_lag": {"time_constant": 0.02}}, "own_curves": [],
                      "outside": None, "severity": 3.1},
        "case-0001": {"kind": "outside", "effects": {}, "own_curves": [], "outside": lost, "severity": 20.0},
        "case-0002": {"kind": "healthy", "effects": {}, "own_curves": [], "outside": None, "severity": 1.0},
        "case-0003": {"kind": "single", "effects": {"backlash": {"gap": 1e-3}}, "own_curves": ["backlash"],
                      "outside": None, "severity": 1.9},
    }  # fmt: skip
    answers = {
        "case-0000": reply("explained", SAID_LAG),
        "case-0001": reply("unexplained", location={"coordinate": "velocity", "interval": [0.1, 0.2]}),
        "case-0002": reply("explained", SAID_GAP),
    }
    (out / "answers").mkdir(parents=True)
    folder.mkdir()
    (folder / foreign.LABELS).write_text(json.dumps(labels))
    (folder / foreign.LABELS).chmod(0o000)
    for name, said in answers.items():
        (out / "answers" / f"{name}.json").write_text(json.dumps(said))
    foreign.write_report(folder, out)
    found = {s["case"]: s for s in json.loads((out / "scores.json").read_text())}
    assert {name: s["outcome"] for name, s in found.items()} == {
        "case-0000": "right", "case-0001": "as_expected", "case-0002": "wrong"}  # fmt: skip
    assert found["case-0000"]["severity"] == "clear"
    assert found["case-0000"]["covered"] == [["actuator_lag.time_constant", True]]
    assert found["case-0001"]["located_first"]
    assert found["case-0001"]["interval"] is None
    assert json.loads((out / "report.json").read_text())["cases"] == 3


def test_a_foreign_authors_labels_are_locked_while_his_cases_are_answered(tmp_path, monkeypatch, capsys):
    folder, modes = tmp_path / "BD", []
    (folder / "cases" / "case-0000").mkdir(parents=True)
    arguments = ["foreign", str(folder), "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", arguments)
    with pytest.raises(SystemExit) as ended:
        foreign.main()
    assert ended.value.code == 2
    assert "labels.json is not there" in capsys.readouterr().err
    labels = folder / foreign.LABELS
    labels.write_text("{}")
    monkeypatch.setattr(foreign, "answer", lambda *_: modes.append(labels.stat().st_mode & 0o777))
    foreign.main()
    assert modes == [0o000]
    assert "0 cases scored" in capsys.readouterr().out
