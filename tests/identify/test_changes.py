"""Commissioning and today: what appeared is said to have appeared, and an unchanged machine is left alone."""

import pytest

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.result import Change
from identify.mismatch.words import changed
from tests.identify.test_mismatch import recorded

PAIR = {"recordings": 1, "before": True, "duration": 16.0}


def test_an_effect_of_today_is_said_to_have_appeared_and_friction_is_left_alone(tmp_path):
    spec = {"effects": ("position_spring",), "excitation": "loop_scurve", "size": 0.9}
    case, axis, recordings = recorded(tmp_path, seed=73_042, **spec, **PAIR)
    found = diagnose(recordings, axis)
    new = [change for change in found.changes if change.effect is not None]
    assert [(change.effect, change.parameter, change.kind) for change in new] == [
        ("position_spring", "stiffness", "appeared")
    ]
    truth = case.labels["effects"]["position_spring"]["stiffness"]
    assert new[0].ci95[0] < truth < new[0].ci95[1]
    assert abs(new[0].before) < 0.2 * abs(truth)
    assert [change.effect for change in found.changes] == ["position_spring"]
    assert "appeared" in found.explanation


def test_what_friction_and_the_constant_force_swallow_shows_against_commissioning(tmp_path):
    spec = {"effects": ("coulomb_asymmetry",), "excitation": "loop_scurve", "size": 0.9, "noise": 1e-3}
    _, axis, recordings = recorded(tmp_path, seed=14_100, orientation="rotary", **spec, **{**PAIR, "duration": 30.0})
    alone = diagnose(recordings[1:], axis)
    assert "coulomb_asymmetry" not in {effect.name for effect in alone.effects}
    found = diagnose(recordings, axis)
    assert "coulomb_asymmetry" in {name for names in found.alternatives for name in names}
    assert found.fit["extended"].held_out < 0.85 * found.fit["baseline"].held_out


@pytest.mark.parametrize(("wear", "moved"), [(1.0, False), (1.25, True)])
def test_dry_friction_that_rose_is_seen_and_that_did_not_is_not(tmp_path, wear, moved):
    case, axis, recordings = recorded(tmp_path, seed=73_021, excitation="multisine", wear=wear, **PAIR)
    found = diagnose(recordings, axis)
    names = {change.parameter for change in found.changes}
    assert ("coulomb_force" in names or "static_force" in names) == moved
    assert {change.effect for change in found.changes} <= {None}
    if moved:
        truth = {name: (1.0 - 1.0 / wear) * case.labels["friction"][name] for name in names}
        for change in found.changes:
            assert change.after - change.before == pytest.approx(truth[change.parameter], rel=0.15)
            assert change.ci95[0] <= change.after - change.before <= change.ci95[1]
        assert "Since commissioning" in found.explanation


def test_words_name_the_effect_and_the_direction():
    text = changed((Change("amplitude", 0.0, 41.0, "N", (37.0, 45.0), "rail_defect", "appeared"),
                    Change("coulomb_force", 90.0, 80.0, "N", (-12.0, -8.0))))  # fmt: skip
    assert "runs harder or easier has appeared (amplitude 0 to 41 N)" in text
    assert "the coulomb force moved from 90 to 80 N" in text
    assert changed(()) == ""
