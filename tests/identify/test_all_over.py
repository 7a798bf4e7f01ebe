"""Tenths from all over the recordings judge what their ends, or the other recording, know nothing of."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from identify.mismatch import all_over, diagnosis
from identify.mismatch.all_over import may_lack, tells_more
from identify.mismatch.compare import Comparison
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.data import SPREAD, Judges, gather
from identify.mismatch.result import Verdict
from tests.identify.small_machine import AXIS, driven, dry
from tests.identify.test_set_aside import LOGGED, STAND_INS, concluded

VISCOUS = 20.0  # N s/m, of oil, beside the 15 N s/m of `dry`


@pytest.mark.parametrize(("seconds", "blocks"), [(12.0, 10), (8.0, 5)])
def test_of_every_five_tenths_two_judge_and_three_are_fitted(seconds, blocks):
    recordings = [driven(seed, lambda _t, _y, v: (dry(v), 0.0), seconds) for seed in (1, 2)]
    found = gather(recordings, AXIS, Judges.TENTHS)
    block = round(100 * seconds / blocks)
    fitted = np.concatenate([np.isin(np.arange(block * blocks) // block % 5, (0, 2, 4))] * 2)
    every = np.concatenate([recording.position for recording in recordings])
    np.testing.assert_array_equal(found.train.position, every[fitted])
    np.testing.assert_array_equal(found.held_out.position, every[~fitted])
    assert found.train.runs == 6 * blocks // 5  # what a gap, or another recording, separates
    assert found.kind == "time"
    assert SPREAD.format(2, 5) in found.removed


def test_a_warmth_that_is_over_when_the_end_judges_is_told_all_over():
    """Viscous friction that falls by 11 % within 1.5 s: the last 40 % of 20 s know nothing of it."""
    found = diagnosis.diagnose(
        [driven(3, lambda t, _, v: (dry(v) + VISCOUS * abs(v) * (1.0 + 0.2 * math.exp(-t / 1.5)), 0.0))], AXIS
    )
    assert [effect.name for effect in found.effects] == ["thermal_drift"]
    drop, constant = (found.effects[0].parameters[name] for name in ("relative_drop", "time_constant"))
    assert drop.value == pytest.approx(0.2 * VISCOUS / (VISCOUS + 15.0), rel=0.1)
    assert constant.value == pytest.approx(1.5, rel=0.1)
    assert SPREAD.format(2, 5) in found.preprocessing
    assert found.fit["extended"].held_out < found.fit["baseline"].held_out


@pytest.mark.parametrize(
    ("verdict", "left", "force", "lacks"),
    [
        ("NO_MISMATCH", 0.1, 0.0, True),
        ("UNEXPLAINED", 0.1, 0.0, True),
        ("EXPLAINED", 0.1, 0.1, False),
        ("EXPLAINED", 0.4, 0.1, True),
        ("EXPLAINED", 0.1, 0.2, True),
    ],
)
def test_names_that_leave_little_error_and_little_force_are_complete(verdict, left, force, lacks):
    chosen = SimpleNamespace(latent_force=force, dry_level=10.0)
    first = SimpleNamespace(
        verdict=Verdict[verdict], error_left=left, selection=SimpleNamespace(steps=["one"], chosen=chosen),
        recognised=False, happened=False,
    )  # fmt: skip
    assert may_lack(first) is lacks


@pytest.mark.parametrize(
    ("recognised", "happened", "lacks"), [(True, False, False), (True, True, True), (False, False, True)]
)
def test_physics_in_no_catalogue_that_lasts_is_known(recognised, happened, lacks):
    """A warming torque constant was a wrong mass and a step; a brake that opens late was a torque that is clipped."""
    first = SimpleNamespace(verdict=Verdict.UNEXPLAINED, recognised=recognised, happened=happened)
    assert may_lack(first) is lacks


def test_a_constant_force_alone_may_be_half_of_the_truth():
    assert may_lack(SimpleNamespace(verdict=Verdict.EXPLAINED, selection=SimpleNamespace(steps=[])))


def tenths(names, verdict=Verdict.EXPLAINED):
    return SimpleNamespace(verdict=verdict, said=set(names), told=set(names))


def begun(names, *, denied=False, outdone=False):
    return SimpleNamespace(told=set(names), denies=lambda _: denied, outdoes=lambda _: outdone)


@pytest.mark.parametrize(
    ("found", "first", "more"),
    [
        (tenths({"thermal_drift"}), begun(()), True),
        (tenths({"thermal_drift"}, Verdict.UNEXPLAINED), begun(()), False),
        (tenths({"thermal_drift"}), begun((), denied=True), False),
        (tenths({"torque_saturation"}), begun((), outdone=True), False),
        (tenths({"step_change"}), begun(()), False),
        (tenths({"step_change", "torque_ripple"}), begun({"torque_ripple"}), False),
        (tenths({"step_change", "torque_ripple"}), begun(()), True),
        (tenths({"torque_ripple"}), begun({"torque_ripple"}), False),
        (tenths({"torque_ripple", "position_spring"}), begun({"torque_ripple"}), True),
        (tenths({"torque_ripple", "position_spring"}), begun({"backlash"}), False),
        (tenths({"torque_ripple"}), begun({"torque_ripple", "position_spring"}), False),
        (tenths({"coulomb_asymmetry", "thermal_drift"}), begun({"force_offset"}), True),
        (tenths({"coulomb_asymmetry"}), begun({"force_offset"}), False),
    ],
)
def test_names_from_all_over_are_the_answer_where_they_are_more(monkeypatch, found, first, more):
    monkeypatch.setattr(all_over, "_undenied", lambda *_: True)
    assert tells_more(found, first) is more
    monkeypatch.setattr(all_over, "_undenied", lambda *_: False)
    assert not tells_more(found, first)


@pytest.mark.parametrize(("foreseen", "undenied"), [((19.0, 25.0), True), ((-1.0, 25.0), True), ((-1135.0, 9), False)])
def test_none_of_them_is_denied_by_another_recording(monkeypatch, foreseen, undenied):
    """A torque constant and a place that was harder in one of two recordings; a warmth that was over is silent."""
    problem = SimpleNamespace(guises=("one", "other"))
    baseline = SimpleNamespace(problem=SimpleNamespace(including=lambda _: problem))
    first = SimpleNamespace(selection=SimpleNamespace(baseline=baseline), evidence=SimpleNamespace(held_out=None))
    steps = [SimpleNamespace(guise=guise) for guise in problem.guises]
    found = SimpleNamespace(selection=SimpleNamespace(steps=steps), final=SimpleNamespace(problem=problem))
    told = dict(zip(problem.guises, foreseen, strict=True))
    monkeypatch.setattr(all_over, "starts_from", lambda *_: None)
    monkeypatch.setattr(all_over, "fit", lambda *_: SimpleNamespace(problem=problem))
    monkeypatch.setattr(all_over, "without", lambda _, guise: guise)
    monkeypatch.setattr(all_over, "compare", lambda rest, *_: Comparison(-300.0, 4.0, -200.0, 0.8, 0.8, told[rest]))
    assert all_over._undenied(found, first) is undenied


@pytest.mark.parametrize("more", [True, False])
def test_they_are_asked_where_a_name_may_be_missing(monkeypatch, more):
    found = {
        "LAST": concluded("LAST", "UNEXPLAINED", set(), several=False),
        "TENTHS": object.__new__(Conclusion),
    }
    stand_ins = {**STAND_INS, "may_lack": lambda _: True, "tells_more": lambda *_: more}
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(diagnosis, name, stand_in)
    monkeypatch.setattr(diagnosis, "_selected", lambda _, judges, *__: found[judges])
    assert diagnosis.conclude([LOGGED], None) is found["TENTHS" if more else "LAST"]


def test_what_is_told_are_names_that_are_there_and_a_constant_force():
    constant = SimpleNamespace(effect=SimpleNamespace(name="force_offset"))
    found = SimpleNamespace(
        verdict=Verdict.EXPLAINED, constant=constant, offset_named=True, named=[SimpleNamespace(name="backlash")]
    )
    assert Conclusion.told.fget(found) == {"backlash", "force_offset"}
    found.offset_named = False
    assert Conclusion.told.fget(found) == {"backlash"}
    found.verdict = Verdict.UNEXPLAINED
    assert Conclusion.told.fget(found) == set()
