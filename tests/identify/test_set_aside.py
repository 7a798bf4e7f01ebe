"""Recordings in which the axis stays where it is, and names of which free runs say little until others judge."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import diagnosis
from identify.mismatch.compare import Comparison
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.data import gather
from identify.mismatch.result import Verdict
from identify.preprocess import prepare
from plant.axis_file import read_axis
from plant.recording_files import read_recording_entry
from tests.reference.cases import CaseSpec, draw_case, write_case

TRAIN_SEED = 6100


@pytest.fixture(scope="module")
def lively(tmp_path_factory):
    """An axis, and two recordings in which it moves."""
    folder = tmp_path_factory.mktemp("case")
    axis = read_axis(
        write_case(draw_case(CaseSpec(TRAIN_SEED, excitation="multisine", noise=1e-5, duration=8.0)), folder)
    )
    return axis, [read_recording_entry(entry, axis) for entry in axis.recordings]


def stuck(recording, at=80):
    """The recording of an axis that stops at sample `at`: friction holds it."""
    position = recording.position.copy()
    position[at:] = position[at]
    return replace(recording, position=position, velocity=None)


def moving(recordings, axis):
    return diagnosis._moving(recordings, [prepare(recording, axis) for recording in recordings], axis)


def test_one_in_which_the_axis_hardly_moves_is_set_aside_and_said_to_be(lively):
    """A linear motor that stood in the first of two recordings had `insufficient_data`, the second told it all."""
    axis, (one, two) = lively
    held = stuck(one)
    assert moving([one, two], axis) == ([one, two], ())
    kept, said = moving([held, two], axis)
    assert kept == [two]
    assert len(said) == 1
    assert "set aside: only" in said[0]
    assert said[0] in gather(kept, axis, removed=said).removed


def test_nothing_is_set_aside_where_none_of_its_state_would_be_left(lively):
    """Not what is to be compared: a machine that stands today is not the one that moved at commissioning."""
    axis, (one, two) = lively
    before, today = replace(one, note="commissioning"), replace(stuck(two), note="today")
    for recordings in ([stuck(one), stuck(two)], [before, today], [stuck(one)]):
        assert moving(recordings, axis) == (recordings, ())


def told(evidence, **other):
    """Fitted and unseen data that are far likelier with a name."""
    given = {"again": 677.0, "steady": -1372.0, "lacking": 0.6, **other}
    return replace(Comparison(-evidence, 9.8, -1372.0, 0.85, 0.86, 921.0, 4.5), **given)


@pytest.mark.parametrize(
    ("evidence", "stands", "pays", "unpaid"),
    [
        (told(1685.0), True, False, True),
        (told(1685.0), True, True, False),
        (told(1685.0), False, False, False),
        (told(1685.0, foreseen=20.0, foreseen_z=0.5), True, False, False),
        (told(1685.0, steady=-100.0), True, False, False),
    ],
)
def test_names_that_free_runs_do_not_pay_are_those_all_data_speak_for(evidence, stands, pays, unpaid):
    fake = SimpleNamespace(
        selection=SimpleNamespace(steps=["load"]), _gained=evidence, stands=stands, pays=lambda: pays
    )
    assert Conclusion.unpaid.fget(fake) is unpaid


STAND_INS = {
    "_known_before": lambda found: found, "gather": lambda *given: given[2].name, "carried": lambda *_: None,
    "_moving": lambda recordings, *_: (recordings, ()), "unusable": lambda *_: None, "prepare": lambda *_: None,
    "too_broken": lambda _: None, "told_twice": lambda *_: None, "happened_once": lambda _: None,
    "loudest_alone": lambda *_: None, "may_lack": lambda _: False,
}  # fmt: skip
LOGGED = SimpleNamespace(loop="open", hold=None, t=np.arange(3.0))


def concluded(judges, verdict, said, *, several=True, **changed):
    """What is concluded where these judge."""
    made = SimpleNamespace(
        verdict=Verdict[verdict], said=said, judges=judges, torn=False, hinted=False, unpaid=False, slight=False,
        outreached=False, kept=False,
        recognised=False, spelled=True, confirmed=False, happened=False, foretells_name=False, bent=set(),
        evidence=SimpleNamespace(kind="recording" if several else "time"),
        selection=SimpleNamespace(steps=[]),
        denies=lambda _: False, holds_beside=lambda _: False, confirms=lambda _: False,
    )  # fmt: skip
    made.repeats = lambda other: Conclusion.repeats(made, other)
    made.straightens = made.outweighs = made.outdoes = made.outlasts = lambda _: False
    for name, value in changed.items():
        setattr(made, name, value)
    return made


@pytest.mark.parametrize("several", [True, False])
@pytest.mark.parametrize(
    ("said", "verdict", "named"),
    [({"load"}, "EXPLAINED", True), ({"mass"}, "EXPLAINED", False), ({"load"}, "UNEXPLAINED", False)],
)
def test_the_other_end_of_a_recording_may_confirm_them(monkeypatch, said, verdict, named, several):
    """Friction that grows with the force by 1.6 %: 1685 and 921, but 92 % of the error; of the end 1697, 937, 90 %."""
    found = {
        "LAST": concluded("LAST", "UNEXPLAINED", {"load"}, several=several, unpaid=True),
        "PART": concluded("PART", verdict, said, several=several),
        "OTHERS": concluded("OTHERS", "UNEXPLAINED", {"load"}),
    }
    for name, stand_in in STAND_INS.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    monkeypatch.setattr(diagnosis, "_selected", lambda _, judges, *__: found[judges])
    assert diagnosis.conclude([LOGGED] * (1 + several), None).judges == ("PART" if named else "LAST")


@pytest.mark.parametrize(
    ("outreached", "verdict", "other", "asked"),
    [
        (True, "NO_MISMATCH", "EXPLAINED", True),
        (False, "NO_MISMATCH", "EXPLAINED", False),
        (True, "UNEXPLAINED", "EXPLAINED", False),
        (True, "NO_MISMATCH", "UNEXPLAINED", False),
    ],
)
def test_an_end_that_asks_for_more_than_was_fitted_is_fitted_too(monkeypatch, outreached, verdict, other, asked):
    """A torque limit of 38 N m that only the last third met, severity 12: none is looked for that nothing met."""
    found = {
        "LAST": concluded("LAST", verdict, set(), several=False, outreached=outreached),
        "PART": concluded("PART", other, {"torque_saturation"}, several=False),
    }
    for name, stand_in in STAND_INS.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    monkeypatch.setattr(diagnosis, "_selected", lambda _, judges, *__: found[judges])
    monkeypatch.setattr(diagnosis, "told_twice", lambda *_: None)
    assert diagnosis.conclude([LOGGED], None).judges == ("PART" if asked else "LAST")


@pytest.mark.parametrize(
    ("force", "position", "further"),
    [(50.0, 0.5, True), (38.5, 0.5, False), (30.0, 0.56, True), (30.0, 0.52, False), (30.0, -0.1, True)],
)
def test_how_far_the_end_of_a_recording_reaches(force, position, further):
    fitted = SimpleNamespace(force=np.array([-38.0, 20.0]), position=np.array([0.0, 0.5]))
    unseen = SimpleNamespace(force=np.array([-force, 1.0]), position=np.array([0.2, position]))
    found = SimpleNamespace(evidence=SimpleNamespace(train=fitted, held_out=unseen))
    assert Conclusion.outreached.fget(found) is further


@pytest.mark.parametrize(
    ("changed", "asked"),
    [
        ({}, True),
        ({"foretells_name": False}, False),
        ({"foretells_name": False, "kept": True}, True),
        ({"recognised": True}, False),
        ({"recognised": True, "kept": True}, False),
        ({"verdict": "EXPLAINED"}, False),
    ],
)
def test_a_name_that_one_end_of_a_single_recording_foretells_is_asked_of_the_other(monkeypatch, changed, asked):
    """Or one that stands there and does not pay: an asymmetry of 0.25 and 0.19, true: 0.24 (BO-0060)."""
    given = {"verdict": "NO_MISMATCH", "foretells_name": True, **changed}
    found = {
        "LAST": concluded("LAST", said=set(), several=False, **given),
        "PART": concluded("PART", "NO_MISMATCH", set(), several=False),
    }
    for name, stand_in in STAND_INS.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    monkeypatch.setattr(diagnosis, "_selected", lambda _, judges, *__: found[judges])
    twice = concluded("BOTH", "EXPLAINED", {"load"}, several=False)
    monkeypatch.setattr(diagnosis, "told_twice", lambda *both: twice if both == tuple(found.values()) else None)
    assert diagnosis.conclude([LOGGED], None) is (twice if asked else found["LAST"])


@pytest.mark.parametrize(
    ("steps", "evidence", "stands", "kept"),
    [(1, 611.0, True, True), (0, 611.0, True, False), (1, 59.0, True, False), (1, 611.0, False, False)],
)
def test_the_other_end_is_asked_for_strong_names_that_stand(steps, evidence, stands, kept):
    found = SimpleNamespace(selection=SimpleNamespace(steps=[None] * steps), _evidence=evidence, stands=stands)
    assert Conclusion.kept.fget(found) is kept


@pytest.mark.parametrize(
    ("changed", "outweighs"),
    [
        ({}, True),
        ({"interval": (3.5, 14.5)}, False),
        ({"interval": (0.0, 22.0), "evidence": 156.0}, True),
        ({"evidence": 5000.0}, False),
        ({"coordinate": "position"}, False),
        ({"slight": True}, False),
        ({"denied": True}, False),
    ],
)
def test_a_name_outweighs_the_moment_that_kept_it_from_being_seen(changed, outweighs):
    """A ripple that the end of a recording told, 8150; its beginning was left with a second at the torque's limit.

    What is less than 3 % of it may last: a step where fitted data ended left the rest of them with 156.
    """
    given = {"interval": (3.5, 4.5), "evidence": 1556.0, "coordinate": "time", **changed}
    moment = SimpleNamespace(**given)
    whole = SimpleNamespace(
        verdict=Verdict.UNEXPLAINED, nameless=[moment], denies=lambda _: given.get("denied", False),
        remains=SimpleNamespace(duration=25.0),
    )  # fmt: skip
    whole.happened = Conclusion.happened.fget(whole)
    part = SimpleNamespace(
        verdict=Verdict.EXPLAINED, said={"torque_ripple"}, slight=given.get("slight", False), _evidence=8150.0
    )
    assert Conclusion.outweighs(part, whole) is outweighs


@pytest.mark.parametrize(("also", "judges"), [(False, "LAST"), (True, "PART")])
def test_what_parts_leave_without_a_name_does_not_replace_what_the_whole_recognised(monkeypatch, also, judges):
    found = {
        "LAST": concluded("LAST", "UNEXPLAINED", set(), several=False, torn=True, recognised=True),
        "PART": concluded("PART", "UNEXPLAINED", set(), several=False, recognised=also),
    }
    found["LAST"].spelled = False
    for name, stand_in in STAND_INS.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    monkeypatch.setattr(diagnosis, "_selected", lambda _, judges, *__: found[judges])
    assert diagnosis.conclude([LOGGED], None).judges == judges


@pytest.mark.parametrize(
    ("recognised", "here", "evidence", "outdone"),
    [
        (True, 1397.0, 2583.0, True),
        (True, 1600.0, 2583.0, False),
        (True, 1397.0, 5000.0, False),
        (False, 1397.0, 2583.0, False),
    ],
)
def test_parts_must_tell_a_name_far_better_than_the_whole_tells_what_has_none(recognised, here, evidence, outdone):
    """A brake that opens late, 1804, was a torque that is clipped, 1397 and, where parts of both judged, 2583."""
    names = ("torque_saturation", here, False), ("dwell_time_stiction", 1722.0, True)
    opening = [
        SimpleNamespace(guise=SimpleNamespace(name=name), evidence=SimpleNamespace(bic=-told), misplaced=odd)
        for name, told, odd in names
    ]
    whole = SimpleNamespace(
        recognised=recognised, nameless=[SimpleNamespace(evidence=1804.0)], selection=SimpleNamespace(opening=opening)
    )
    parts = SimpleNamespace(_evidence=evidence, said={name for name, *_ in names})
    assert Conclusion.outdoes(whole, parts) is outdone
