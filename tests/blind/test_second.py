"""A slice of the blind study on cases of the second simulator: sealed, read as a user would, scored alike."""

import json

import numpy as np
import pytest

from plant.axis_file import read_axis
from plant.effects import CATALOGUE, find
from plant.recording_files import read_recording_entry
from tests.blind import second
from tests.blind.__main__ import write_report
from tests.blind.diagnosing import ROOT
from tests.blind.scoring import score
from tests.blind.sealing import Study, seal
from tests.second.cases import CaseSpec, draw_case, write_case
from tests.second.effects import EFFECTS, draw_effect
from tests.second.outside import COORDINATES
from tests.second.plants import draw_plant


def reply(label):
    """An answer that is right to the last digit, where there is anything to say."""
    effects = [{"name": name, "parameters": {key: {"value": value, "ci95": [value, value]} for key, value in e.items()}}
               for name, e in label["effects"].items()]  # fmt: skip
    location = None
    if outside := label["outside"]:
        location = {"coordinate": outside["coordinates"][0], "interval": outside["interval"]}
    fit = {name: {"held_out": value} for name, value in (("baseline", 1.0), ("extended", 0.1))}
    answer = {"verdict": label["expected"], "effects": effects, "alternatives": [], "location": location, "fit": fit}
    return {"answer": answer, "seconds": 1.0, "cpu": 1.0}


def drawn(spec, seed=3):
    """A case of `spec`; the first draws that show what they hide."""
    for attempt in range(second.ATTEMPTS):
        try:
            return draw_case(np.random.default_rng([seed, attempt]), spec)
        except second.UndrawableError:
            continue
    raise AssertionError(spec)


def test_a_study_draws_every_kind_and_each_case_from_its_number_alone():
    specs = [second.draw_spec(5, index) for index in range(200)]
    assert {spec.kind for spec in specs} == set(second.KINDS)
    assert specs[77] == second.draw_spec(5, 77)
    assert specs != [second.draw_spec(6, index) for index in range(200)]


def test_names_parameters_and_coordinates_are_those_of_the_contract():
    assert set(EFFECTS) == set(CATALOGUE)
    for name, variant in ((name, variant) for name in EFFECTS for variant in (0, 1)):
        rng = np.random.default_rng(4)
        plant = draw_plant(rng, {name}, variant)
        hidden = draw_effect(rng, name, plant, (plant.low, plant.high), variant)
        known = {parameter.name for parameter in find(name).parameters if parameter.reported}
        assert set(hidden.of(hidden.first).parameters) <= known, name
    page = (ROOT / "docs" / "json.md").read_text(encoding="utf-8")
    assert all(f"`{coordinate}`" in page for names in COORDINATES.values() for coordinate in names)


@pytest.mark.parametrize(
    ("spec", "seed"),
    [(CaseSpec("single", ("torque_ripple",)), 1), (CaseSpec("single", ("thermal_drift",), 1), 2),
     (CaseSpec("outside", ("brake_interval",)), 3), (CaseSpec("smooth"), 4), (CaseSpec("smooth"), 5)],
)  # fmt: skip
def test_files_are_accepted_and_move_within_what_they_promise(tmp_path, spec, seed):
    case = drawn(spec, seed)
    axis = read_axis(write_case(case, tmp_path))
    assert len(axis.recordings) == len(case.tables)
    for entry in axis.recordings:
        recording = read_recording_entry(entry, axis)
        low, high = axis.mechanics.travel
        assert low <= recording.position.min()
        assert recording.position.max() <= high
        assert np.ptp(recording.position) > 0.25 * case.labels["travel"]
        assert np.abs(recording.force).max() <= 1.1 * axis.drive.rated_force
    known = case.labels["friction"]
    assert np.abs(recording.force).max() > known["coulomb_force"]  # it slides, so it takes more than dry friction
    got = score("case-0000", {"kind": spec.kind, "true_criterion": None, **case.labels}, reply(case.labels))
    assert got.good
    assert got.interval in (None, True)
    assert all(name.split(".")[0] not in case.labels["shapes"] for name, _ in got.covered)


def test_severity_is_the_simulators_own_where_it_knows_no_criterion():
    known = drawn(CaseSpec("single", ("coulomb_asymmetry",))).labels
    for ratio, severity in ((1.1, "hidden"), (2.0, "faint"), (5.0, "clear"), (50.0, "strong")):
        label = {"kind": "single", "true_criterion": None, **known, "severity_ratio": ratio}
        assert score("case-0000", label, reply(known)).severity == severity
    assert score("case-0000", label | {"true_criterion": 0.5}, reply(known)).severity == "faint"


def test_labels_are_sealed_first_the_folders_do_not_tell_and_the_report_counts(tmp_path):
    study = Study(20, 2, tmp_path, simulator="second")
    first = seal(study, range(2))
    assert seal(study, range(2)) == first
    labels = json.loads(study.labels(range(2)).read_text())
    assert json.loads(json.dumps(second.draw(20, 1, "case-0001")[0])) == labels["case-0001"]  # from its number alone
    (tmp_path / "answers").mkdir()
    for index in range(2):
        files = {file.name for file in study.case(index).iterdir()}
        assert files <= {"axis.toml", "rec1.csv", "rec2.csv"}
        text, name = (study.case(index) / "axis.toml").read_text(), study.name(index)
        assert f'name = "{name}"' in text
        assert not any(word in text for word in labels[name]["effects"])
        study.answer(index).write_text(json.dumps(reply(labels[name])))
    assert "second simulator, seed 20: 2 cases scored" in write_report(study, 2)
    assert all(one["good"] for one in json.loads((tmp_path / "scores.json").read_text()))
