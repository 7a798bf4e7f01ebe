"""One stray message makes nothing old, a publisher that starts anew loses nothing, and no sample is taken twice."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.epochs import REMEMBERED, WAITING
from monitor.samples import GapKind, Samples, StreamState, WindowRule
from monitor.store_rows import stream_of
from monitor.windows import Assembler

STEP = 10_000_000
RULE = WindowRule(samples=20, hop=7, sample_time_ns=STEP, patience=1.0, silence=10.0)
HUGE = 2**62
WAITS = st.sampled_from([0.0, 0.4, 3.0, 15.0])
REFUSED = ("duplicates", "late", "old_epoch", "stray_epoch", "stray_seq")


def run(first, end, epoch=1, begin=0):
    """Samples `first` to `end` of an epoch that began `begin` samples after the first one."""
    seq = np.arange(first, end)
    return Samples(epoch, first, (seq + begin) * STEP, seq * 0.1, seq * 0.01)


def offer(assembler, deliveries):
    """Deliver (when, block) in turn, looking for gaps now and then, and half a minute longer; all outcomes."""
    outs, clock = [], 0.0
    for when, block in [*deliveries, (deliveries[-1][0] + 30.0, None)]:
        outs += [assembler.settle(clock + wait) for wait in (0.5, 1.1, 2.0, 10.1) if clock + wait < when]
        outs.append(assembler.settle(when))
        clock = when
        if block is not None:
            outs.append(assembler.offer(block, clock))
    return outs


def taken(outs):
    """(epoch, number) of every sample accepted, in order."""
    return [(part.epoch, k) for out in outs for part in out.accepted for k in range(part.seq, part.end)]


def refused(outs):
    return {name: count for name in REFUSED if (count := sum(getattr(out, name) for out in outs))}


def reopened(assembler):
    """The same axis after a restart: what was not settled is forgotten."""
    stored = json.loads(json.dumps(dataclasses.asdict(assembler.state)))
    return Assembler(RULE, stream_of(stored))


def test_a_second_message_begins_an_epoch_and_both_are_taken():
    assembler = Assembler(RULE)
    assembler.offer(run(0, 15), 0.0)
    assert not assembler.offer(run(0, 15, epoch=2), 0.1).accepted
    out = assembler.offer(run(15, 25, epoch=2), 0.2)
    assert [(gap.kind, gap.epoch, gap.from_seq) for gap in out.gaps] == [(GapKind.EPOCH, 1, 15)]
    assert taken([out]) == [(2, k) for k in range(25)]
    assert [(window.id.epoch, window.id.first_seq) for window in out.windows] == [(2, 0)]


def test_a_single_message_begins_an_epoch_once_the_old_one_is_silent():
    assembler = Assembler(RULE)
    outs = offer(assembler, [(0.0, run(0, 10)), (0.1, run(10, 20)), (0.2, run(0, 10, epoch=2))])
    assert taken(outs)[20:] == [(2, k) for k in range(10)]
    assert assembler.state.epoch == 2
    assert not refused(outs)


def test_the_tail_of_the_old_epoch_is_taken_until_the_new_one_begins_and_old_afterwards():
    assembler = Assembler(RULE)
    blocks = [run(0, 10), run(0, 10, epoch=2), run(10, 20), run(10, 20, epoch=2), run(20, 30), run(20, 30, epoch=2)]
    outs = offer(assembler, [(0.1 * k, block) for k, block in enumerate(blocks)])
    assert taken(outs) == [(1, k) for k in range(20)] + [(2, k) for k in range(30)]
    assert refused(outs) == {"old_epoch": 10}


@st.composite
def streams(draw):
    """A machine's stream, with restarts of its publisher and pauses, as (time, block); blocks come in order."""
    deliveries, clock = [], 0.0
    for epoch in sorted(draw(st.sets(st.integers(1, 1000), min_size=1, max_size=4))):
        first = 0
        for n in draw(st.lists(st.integers(1, 30), min_size=1, max_size=6)):
            clock += draw(st.sampled_from([0.1, 0.3, 3.0, 40.0]))
            deliveries.append((clock, run(first, first + n, epoch, begin=round(clock * 100))))
            first += n
    return deliveries


@given(streams())
@settings(max_examples=100, deadline=None)
def test_publishers_that_start_anew_lose_nothing_and_wait_for_nothing(deliveries):
    outs = offer(Assembler(RULE), deliveries)
    assert taken(outs) == [(b.epoch, k) for _, b in deliveries for k in range(b.seq, b.end)]
    assert not refused(outs)


@given(streams(), st.data())
@settings(max_examples=200, deadline=None)
def test_a_message_of_a_far_epoch_costs_nothing_but_itself_also_across_restarts(deliveries, data):
    at = data.draw(st.integers(0, len(deliveries)), label="stray before delivery")
    when = deliveries[at - 1][0] + 0.01 if at else 0.05
    stray = run(data.draw(st.sampled_from([0, 5, 10**12])), 0, HUGE)
    stray = run(stray.seq, stray.seq + data.draw(st.integers(1, 60)), HUGE, begin=round(100 * when) - stray.seq)
    restart = data.draw(st.integers(0, len(deliveries)), label="restart before delivery")
    rows = [*deliveries[:at], (when, stray), *deliveries[at:]]
    assembler = Assembler(RULE)
    outs = offer(assembler, rows[: restart + 1]) if restart else []
    outs += offer(reopened(assembler) if restart else assembler, rows)  # publishers' caches repeat everything
    genuine = [(b.epoch, k) for _, b in deliveries for k in range(b.seq, b.end)]
    got = taken(outs)
    assert sorted(one for one in got if one[0] != HUGE) == sorted(genuine)  # each once, none lost
    assert len(set(got)) == len(got)


@given(
    st.lists(st.tuples(st.integers(1, 5), st.integers(0, 40), st.integers(1, 12), WAITS), min_size=1, max_size=30),
    st.integers(0, 30),
)
@settings(max_examples=200, deadline=None)
def test_whatever_comes_no_sample_is_taken_twice_and_each_is_accounted_for(messages, restart):
    clock, rows = 0.0, []
    for epoch, first, n, wait in messages:
        clock += wait
        rows.append((clock, run(first, first + n, epoch, begin=round(100 * clock))))
    assembler = Assembler(RULE)
    outs = offer(assembler, rows)
    got = taken(outs)
    assert len(set(got)) == len(got)
    sent = sum(len(block) for _, block in rows)
    waiting = sent - len(got) - sum(refused(outs).values())
    assert waiting >= 0
    assert (waiting == 0) == (assembler.held == 0)
    part = rows[: restart + 1]
    first = Assembler(RULE)
    both = taken(offer(first, part)) + taken(offer(reopened(first), rows))
    assert len(set(both)) == len(both)
    gaps = [(gap.kind, gap.epoch, gap.from_seq) for out in outs for gap in out.gaps]
    assert len(set(gaps)) == len(gaps)  # as the table of gaps demands


def test_an_earlier_epoch_is_believed_when_the_later_one_is_silent():
    """A clock that was set back, or that was wrong for a day: nothing of either is lost."""
    assembler = Assembler(RULE)
    wrong = [(0.1 * k, run(10 * k, 10 * k + 10, epoch=2000)) for k in range(5)]
    right = [(2.0 + 0.1 * k, run(10 * k, 10 * k + 10, epoch=1000)) for k in range(120)]
    outs = offer(assembler, wrong + right)
    assert taken(outs) == [(2000, k) for k in range(50)] + [(1000, k) for k in range(1200)]
    assert assembler.state.epoch == 1000
    assert not refused(outs)


def test_an_earlier_epoch_beside_a_living_later_one_is_refused_and_counted():
    assembler = Assembler(RULE)
    rows = [(0.1 * k, run(10 * (k // 2), 10 * (k // 2) + 10, epoch=2 - k % 2)) for k in range(200)]
    outs = offer(assembler, rows)
    assert taken(outs)[:1000] == [(2, k) for k in range(1000)]
    assert refused(outs)["old_epoch"] >= 980


def test_what_was_taken_of_an_epoch_is_remembered_after_many_others():
    assembler = Assembler(RULE)
    epochs = range(1, 3 * REMEMBERED)
    offer(assembler, [(20.0 * e + 0.1 * k, run(10 * k, 10 * k + 10, e)) for e in epochs for k in range(2)])
    assert len(assembler.state.former) == REMEMBERED
    outs = offer(assembler, [(1000.0 + e, run(0, 20, e)) for e in epochs])
    assert not taken(outs)
    assert refused(outs)["old_epoch"] == 20 * (len(epochs) - 1)


def test_what_waits_of_other_epochs_is_bounded():
    assembler = Assembler(dataclasses.replace(RULE, held_samples=100))
    assembler.offer(run(0, 10, epoch=1), 0.0)
    outs = [assembler.offer(run(0, 10, HUGE + k), 0.0) for k in range(50)]
    assert assembler.held <= WAITING
    assert refused(outs)["stray_epoch"] == 10 * (50 - WAITING)
    outs = [assembler.offer(run(0, 90, 100 + k), 0.0) for k in range(2)]
    assert assembler.held <= 2


@pytest.mark.parametrize("live", [True, False])
def test_a_message_with_a_far_number_costs_nothing_but_itself(live):
    assembler = Assembler(RULE)
    stream = [(0.1 * k, run(10 * k, 10 * k + 10)) for k in range(200 if live else 5)]
    late = [] if live else [(25.0 + 0.1 * k, run(50 + 10 * k, 60 + 10 * k, begin=2500)) for k in range(5)]
    stray = dataclasses.replace(run(45, 55), seq=10**15)
    outs = offer(assembler, sorted([*stream, (0.45, stray), *late], key=lambda row: row[0]))
    assert taken(outs) == [(1, k) for k in range(2000 if live else 100)]
    assert refused(outs) == {"stray_seq": 10}
    assert not [gap for out in outs for gap in out.gaps if gap.missing]


def test_a_clock_set_back_during_a_loss_is_borne_out_by_the_next_message():
    assembler = Assembler(RULE)
    rows = [(0.1 * k, run(10 * k, 10 * k + 10, begin=10**6 if k < 5 else 0)) for k in range(20) if k not in (5, 6)]
    outs = offer(assembler, rows)
    assert len(taken(outs)) == 180
    assert [(g.from_seq, g.to_seq) for out in outs for g in out.gaps if g.missing] == [(50, 70)]


def test_a_recovery_that_takes_longer_than_the_patience_makes_no_gap():
    assembler = Assembler(RULE)
    assembler.offer(run(0, 10), 0.0)
    assembler.offer(run(90, 100), 0.1)
    outs = offer(assembler, [(0.9 * k, run(10 * k, 10 * k + 10)) for k in range(1, 9)])
    assert len(taken(outs)) == 90
    assert not [gap for out in outs for gap in out.gaps]


def test_an_older_programs_state_believes_in_no_earlier_epoch():
    state = stream_of({"epoch": 7, "next_seq": 100, "last_ns": 5, "segment_seq": 0, "starts": [[0, 0]]})
    assert state == StreamState(7, 100, 5, 0, ((0, 0),), floor=7)
    outs = offer(Assembler(RULE, state), [(20.0 * k, run(10 * k, 10 * k + 10, epoch=6)) for k in range(1, 4)])
    assert refused(outs) == {"old_epoch": 30}
    assert list(itertools.chain(*[out.accepted for out in outs])) == []
