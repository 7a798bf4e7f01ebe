"""Windows and gaps depend on the samples alone: not on cutting, repetition or order of the blocks."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from monitor.samples import GapKind, Samples, StreamState, WindowRule
from monitor.windows import KEPT_GAPS, Assembler

STEP = 10_000_000
RULE = WindowRule(samples=20, hop=7, sample_time_ns=STEP, patience=1.0)


def run(first, end, epoch=1, pauses=()):
    """Samples `first` to `end` of a machine that pauses a minute before each number in `pauses`."""
    seq = np.arange(first, end)
    late = np.searchsorted(np.sort(np.array(pauses, dtype=int)), seq, side="right")
    return Samples(epoch, first, seq * STEP + late * 60 * 10**9, seq * 0.1, seq * 0.01, temperature=seq * 1.0)


def feed(assembler, blocks, now=0.0):
    """Offer all blocks, then wait long enough; everything that was decided."""
    outcomes = [assembler.offer(block, now) for block in blocks] + [assembler.settle(now + 10.0)]
    return {
        "windows": [window for out in outcomes for window in out.windows],
        "gaps": [gap for out in outcomes for gap in out.gaps],
        "numbers": np.concatenate([np.arange(a.seq, a.end) for out in outcomes for a in out.accepted] or [[]]),
        "stamps": np.concatenate([a.t_ns for out in outcomes for a in out.accepted] or [[]]),
        "duplicates": sum(out.duplicates for out in outcomes),
        "late": sum(out.late for out in outcomes),
        "old_epoch": sum(out.old_epoch for out in outcomes),
    }


def expected(segments):
    """First numbers of the windows of contiguous (first, end) segments."""
    return [k for first, end in segments for k in range(first, end - RULE.samples + 1, RULE.hop)]


@st.composite
def deliveries(draw):
    """A stream of up to 200 samples with lost stretches and pauses, cut, doubled and shuffled at will."""
    n = draw(st.integers(1, 200))
    lost = draw(st.sets(st.integers(0, n - 1), max_size=8))
    pauses = sorted(draw(st.sets(st.integers(1, max(1, n - 1)), max_size=3)))
    kept = [k for k in range(n) if k not in lost]
    runs = np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1) if kept else []
    blocks = []
    for part in runs:
        first, end = int(part[0]), int(part[-1]) + 1
        cuts = sorted(draw(st.sets(st.integers(first, end), max_size=6)) | {first, end})
        for a, b in itertools.pairwise(cuts):
            overlap = draw(st.integers(0, min(3, a - first)))
            blocks.append(run(a - overlap, b, pauses=pauses))
    doubled = blocks + draw(st.lists(st.sampled_from(blocks), max_size=4)) if blocks else []
    return n, kept, pauses, runs, draw(st.permutations(doubled))


@given(deliveries())
@settings(max_examples=300, deadline=None)
def test_any_cutting_repetition_and_order_gives_the_same_windows_and_exact_gaps(delivery):
    _, kept, pauses, runs, blocks = delivery
    if not blocks:
        return
    got = feed(Assembler(RULE), blocks)
    assert got["numbers"].tolist() == kept  # each once, in order
    assert got["stamps"].tolist() == run(0, max(kept) + 1, pauses=pauses).t_ns[kept].tolist()
    segments = [
        (int(piece[0]), int(piece[-1]) + 1)
        for part in runs
        for piece in np.split(part, np.searchsorted(part, [p for p in pauses if part[0] < p <= part[-1]]))
        if len(piece)
    ]
    assert [window.id.first_seq for window in got["windows"]] == expected(segments)
    missing = sorted(k for gap in got["gaps"] for k in range(gap.from_seq, gap.to_seq))
    assert missing == sorted(set(range(max(kept) + 1)) - set(kept))  # what was not received, and nothing else, once
    sent = sum(len(block) for block in blocks)
    assert sent == len(kept) + got["duplicates"] + got["late"]


@given(deliveries(), st.integers(0, 100))
@settings(max_examples=100, deadline=None)
def test_a_restart_from_the_stored_state_changes_no_window(delivery, at):
    *_, blocks = delivery
    ordered = sorted(blocks, key=lambda block: block.seq)
    at = min(at, len(ordered))
    whole = feed(Assembler(RULE), ordered)
    first = Assembler(RULE)
    before = feed(first, ordered[:at])
    state = StreamState(**dataclasses.asdict(first.state))
    after = feed(Assembler(RULE, state), ordered)  # the publisher's cache repeats everything
    assert before["windows"] + after["windows"] == whole["windows"]
    assert [*before["numbers"], *after["numbers"]] == whole["numbers"].tolist()


def test_a_window_knows_when_it_was():
    got = feed(Assembler(RULE), [run(0, 13), run(13, 30)])
    assert [(w.id.first_seq, w.start_ns, w.end_ns) for w in got["windows"]] == [
        (0, 0, 19 * STEP),
        (7, 7 * STEP, 26 * STEP),
    ]


def test_a_missing_block_is_waited_for_and_taken_when_it_comes():
    assembler = Assembler(RULE)
    assert assembler.offer(run(0, 10), 0.0).accepted
    assert not assembler.offer(run(15, 30), 0.1).accepted
    assert not assembler.settle(0.9).gaps
    out = assembler.offer(run(10, 15), 1.0)
    assert sum(len(part) for part in out.accepted) == 20
    assert not out.gaps
    assert [window.id.first_seq for window in out.windows] == [0, 7]


def test_a_block_that_comes_after_its_gap_was_declared_is_late_not_a_duplicate():
    assembler = Assembler(RULE)
    assembler.offer(run(0, 10), 0.0)
    assembler.offer(run(15, 30), 0.0)
    gap = assembler.settle(2.0).gaps[0]
    assert (gap.kind, gap.from_seq, gap.to_seq, gap.from_ns, gap.to_ns) == (
        GapKind.MISSING,
        10,
        15,
        9 * STEP,
        15 * STEP,
    )
    out = assembler.offer(run(8, 17), 2.1)
    assert (out.late, out.duplicates) == (5, 4)
    assert not out.accepted


def test_one_burst_an_hour_is_a_normal_machine():
    bursts = [run(k * 20, (k + 1) * 20, pauses=[20, 40, 60]) for k in range(3)]
    got = feed(Assembler(RULE), bursts)
    assert [window.id.first_seq for window in got["windows"]] == [0, 20, 40]
    assert [(gap.kind, gap.missing) for gap in got["gaps"]] == [(GapKind.PAUSE, 0)] * 2


def test_joining_late_is_told_once_the_wait_for_the_beginning_is_over():
    assembler = Assembler(RULE)
    assert not assembler.offer(run(50, 60), 0.0).accepted
    assembler.offer(run(40, 50), 0.5)
    out = assembler.settle(1.0)
    assert [(gap.kind, gap.from_seq, gap.to_seq) for gap in out.gaps] == [(GapKind.JOINED_LATE, 0, 40)]
    assert assembler.state.next_seq == 60


def test_a_clock_that_steps_back_ends_the_segment():
    back = run(10, 40)
    back = dataclasses.replace(back, t_ns=back.t_ns - 10**12)
    got = feed(Assembler(RULE), [run(0, 10), back])
    assert [window.id.first_seq for window in got["windows"]] == [10, 17]
    assert [gap.kind for gap in got["gaps"]] == [GapKind.PAUSE]


def test_what_waits_is_bounded():
    assembler = Assembler(dataclasses.replace(RULE, held_blocks=5))
    assembler.offer(run(0, 1), 0.0)
    outcomes = [assembler.offer(run(2 * k, 2 * k + 1), 0.0) for k in range(1, 50)]
    assert assembler.held <= 5
    assert sum(gap.missing for out in outcomes for gap in out.gaps) == assembler.state.next_seq // 2


def test_what_waits_is_bounded_in_samples_too():
    assembler = Assembler(dataclasses.replace(RULE, held_samples=100))
    assembler.offer(run(0, 1), 0.0)
    out = assembler.offer(run(10, 100), 0.0)
    assert not out.gaps
    out = assembler.offer(run(110, 200), 0.0)
    assert [(gap.from_seq, gap.to_seq) for gap in out.gaps] == [(1, 10)]


def test_a_stream_whose_every_step_is_a_jump_is_counted_not_noted_sample_by_sample():
    assembler = Assembler(RULE)
    slow = run(0, 100)
    out = assembler.offer(dataclasses.replace(slow, t_ns=slow.t_ns * 2), 0.0)
    assert out.splinters == 99
    assert not out.gaps
    assert [len(part) for part in out.accepted] == [100]  # one row of the journal


def test_gaps_kept_in_memory_are_bounded():
    assembler = Assembler(RULE)
    for k in range(1, 2 * KEPT_GAPS):
        assembler.offer(run(20 * k, 20 * k + 10), 0.0)
        assembler.settle(10.0)
    late = assembler.offer(run(20 * (2 * KEPT_GAPS - 2) + 10, 20 * (2 * KEPT_GAPS - 1)), 20.0)
    assert late.late == 10
    assert assembler.offer(run(30, 40), 20.0).duplicates == 10  # too long ago to tell late from twice


@pytest.mark.parametrize("ratio", [1, 10])
def test_with_an_analysis_rate_a_window_covers_that_many_times_more_samples(ratio):
    from monitor.axis_run import window_rule
    from monitor.config import Config
    from plant.presets import paper_axis

    axis = dataclasses.replace(paper_axis(), analysis_sample_time=0.01 * ratio)
    rule = window_rule(axis, Config(site="s"))
    assert (rule.samples, rule.hop, rule.sample_time_ns) == (2000 * ratio, 500 * ratio, STEP)
