"""Remaining life: an interval that holds, or a reason why there is none."""

import numpy as np

from monitor.trend import BLOCKS, DAY_NS, added, project


def story(days, change, scatter, seed=0, per_day=2):
    rng, blocks = np.random.default_rng(seed), ()
    for k in range(days * per_day):
        day = k / per_day
        blocks = added(blocks, int(day * DAY_NS), change(day) + scatter * rng.standard_normal())
    return blocks


def test_the_interval_holds_the_day_on_which_the_limit_is_reached():
    held = 0
    for seed in range(60):
        blocks = story(60, lambda day: 0.003 * day, 0.015, seed)
        found = project(blocks, 0, 0.015, 0.0, 0.5)
        assert found.refused is None
        held += found.days_low <= 0.5 / 0.003 - 59.5 <= found.days_high
    assert held >= 52  # of 57 expected


def test_a_level_change_a_bend_and_a_far_limit_are_no_projection():
    flat = project(story(60, lambda _: 0.1, 0.015), 0, 0.015, 0.0, 0.5)
    assert "no steady rise" in flat.refused
    bent = project(story(60, lambda day: 2e-4 * day**2, 0.005), 0, 0.005, 0.0, 0.9)
    assert "faster and faster" in bent.refused
    far = project(story(60, lambda day: 0.001 * day, 0.005), 0, 0.005, 0.0, 0.5)
    assert "further away" in far.refused
    few = project(story(3, lambda day: 0.1 * day, 0.001), 0, 0.001, 0.0, 0.5)
    assert "needed" in few.refused
    over = project(story(60, lambda day: 0.01 * day, 0.005), 0, 0.005, 0.0, 0.5)
    assert over.days == 0


def test_a_long_story_stays_short_and_keeps_its_means():
    blocks = story(1000, lambda day: 0.001 * day, 0.0)
    assert len(blocks) == BLOCKS
    assert sum(block[2] for block in blocks) == 2000
    assert all(abs(change - 0.001 * at / DAY_NS) < 2e-6 for at, change, _ in blocks)
