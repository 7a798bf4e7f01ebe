"""When the workers cannot keep up, every live axis gives up the same share of its windows, visibly, until they can."""

import dataclasses

import numpy as np
import pytest

from monitor.alerts import compose
from monitor.drift import Kind
from monitor.pacing import MOST, Load, Pacer
from monitor.windows import Assembler
from monitor.workers import Workers
from plant.presets import paper_axis
from tests.monitor.test_pipeline import AXIS, Bench
from tests.monitor.test_windows import RULE, run
from tests.scenarios.harness import START_NS, blocks_of, burst


def simulate(pacer, coming, able, seconds, state=None):
    """A plant whose axes complete `coming` windows a second at the usual hop; the workers answer `able` a second."""
    waiting, credit, spare, begun = state or ([], 0.0, 0.0, 0)
    factors = []
    for second in range(begun, begun + seconds):
        credit += coming / pacer.factor
        new, credit = int(credit), credit % 1
        waiting = waiting + [second] * new
        spare = min(spare + able, able + 1)
        done = min(len(waiting), int(spare))
        spare -= done
        waiting = waiting[done:]
        before = pacer.factor
        pacer.look(Load(coming, done, second - waiting[0] if waiting else 0.0, len(waiting)), float(second))
        if pacer.factor > before:
            waiting = waiting[:: -pacer.factor][::-1]
        factors.append(pacer.factor)
    return factors, (waiting, credit, spare, begun + seconds)


@pytest.mark.parametrize("overload", [1.5, 4.0, 20.0])
def test_the_hop_is_stretched_until_the_answers_keep_up_and_the_lag_stays_bounded(overload):
    pacer = Pacer(allowed=30.0)
    factors, (waiting, *_) = simulate(pacer, 10 * overload, 10, 1500)
    assert overload <= factors[-1] <= 2 * overload + 2
    assert len(waiting) / 10 <= 60.0  # s to work it off


def test_the_hop_goes_back_when_the_load_has_gone():
    pacer = Pacer(allowed=30.0)
    _, state = simulate(pacer, 60, 10, 800)
    assert pacer.factor >= 6
    simulate(pacer, 4, 10, 800, state)
    assert pacer.factor == 1


def test_an_even_load_below_what_the_workers_can_is_never_stretched():
    factors, _ = simulate(Pacer(allowed=30.0), 9, 10, 2000)
    assert set(factors) == {1}


def test_a_steady_overload_does_not_make_the_hop_swing():
    factors, _ = simulate(Pacer(allowed=30.0), 40, 10, 4000)
    changes = np.count_nonzero(np.diff(factors[1000:]))
    assert changes <= 6  # in 50 min


def test_workers_that_do_not_answer_at_all_stretch_it_to_the_most():
    pacer = Pacer(allowed=10.0)
    simulate(pacer, 5, 0, 100)
    assert pacer.factor == MOST


def test_windows_of_a_stretched_hop_are_some_of_the_usual_ones():
    usual, stretched = Assembler(RULE), Assembler(RULE)
    all_of_them = usual.offer(run(0, 200), 0.0).windows
    first = stretched.offer(run(0, 50), 0.0).windows
    stretched.stretch = 3
    then = stretched.offer(run(50, 130), 0.0).windows
    stretched.stretch = 1
    last = stretched.offer(run(130, 200), 0.0).windows
    assert set(first + then + last) < set(all_of_them)
    assert last[-1] == all_of_them[-1]
    steps = np.diff([window.id.first_seq for window in first + then])
    assert set(steps.tolist()) <= {RULE.hop, 2 * RULE.hop, 3 * RULE.hop}
    assert steps[-1] == 3 * RULE.hop


@pytest.fixture(scope="module")
def busy():
    one = Workers(1)
    yield one
    one.close()


def test_a_daemon_that_falls_behind_says_so_everywhere_and_treats_all_axes_alike(tmp_path, busy):
    other = dataclasses.replace(AXIS, name="axis-2")
    bench = Bench(tmp_path, busy, axes=(AXIS, other), identification={"workers": 1, "max_lag_seconds": 1.0})
    torque, position = burst(paper_axis(), samples=2000)
    streams = {name: list(blocks_of(name, 1, 0, START_NS, torque, position)) for name in ("axis-1", "axis-2")}
    bench.now = START_NS / 1e9  # live: as much wall time passes as event time
    free, Workers.free = Workers.free, property(lambda self: 0)  # as if they were all busy
    try:
        for k in range(10):
            for name in streams:
                bench.put(streams[name][k], f"tribowatch/site/{name}/samples")
            bench.step()
    finally:
        Workers.free = free
    hops = {one["axis"]: one["hop"] for one in bench.heard("status")[-2:]}
    assert hops["axis-1"] == hops["axis-2"]
    assert hops["axis-1"]["stretched"] > 1
    assert bench.heard("status")[-1]["lag"]["windows_seconds"] > 1.0
    left_out = [one["hop"]["left_out"] for one in bench.heard("status")[-2:]]
    assert left_out[0] == left_out[1] > 0
    waiting = {name: run.order for name, run in bench.pipeline.runs.items()}
    assert sorted(row for row, *_ in bench.store.pending()) == sorted(row for rows in waiting.values() for row in rows)
    for _ in range(30):
        bench.finish()
        bench.step()
    assert bench.heard("status")[-1]["hop"]["stretched"] == 1


def test_an_alert_says_that_it_rests_on_fewer_windows():
    alert = compose("site", "a", Kind.DATA_QUALITY, 1, "unacknowledged", 0,
                    {"windows": 3, "reason": "NaN", "hop_stretched": 4})  # fmt: skip
    assert "only every 4th window" in alert["text"]


def test_a_silent_axis_with_old_windows_stretches_nobody(tmp_path, busy):
    bench = Bench(tmp_path, busy, identification={"workers": 1, "max_lag_seconds": 1.0})
    torque, position = burst(paper_axis(), samples=2000)
    free, Workers.free = Workers.free, property(lambda self: 0)
    try:
        for block in blocks_of("axis-1", 1, 0, START_NS, torque, position):
            bench.put(block)  # all at once: a replay
        for _ in range(10):
            bench.step()
    finally:
        Workers.free = free
    status = bench.heard("status")[-1]
    assert (status["pending_windows"], status["hop"]["stretched"]) == (10, 1)
    bench.finish()
