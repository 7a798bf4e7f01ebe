"""The connect-time audit in the corridor: what is mis-scaled is kept and counted, never learned from."""

import collections
import dataclasses

import numpy as np
import pytest

from monitor.audit_watch import PASSES, AuditWatch, Signature
from monitor.drift import Finding, Kind
from monitor.queries import Reader
from monitor.samples import Gap, GapKind, Outcome, Samples
from monitor.starvation import Starvation
from monitor.stream_clock import StreamClock
from monitor.workers import Workers
from plant.axis import Drive
from plant.presets import paper_axis
from plant.wire import Block
from tests.monitor.test_pipeline import Bench
from tests.scenarios.harness import START_NS, STEP_NS, blocks_of, burst

AXIS = dataclasses.replace(paper_axis(), name="axis-1", drive=Drive(rated_force=560.0))
DAY_NS = 86_400 * 10**9
WINDOWS = {"window": {"samples": 2000, "hop": 2000}, "alarms": {"off_windows": 1}}


@pytest.fixture(scope="module")
def workers():
    one = Workers(2)
    yield one
    one.close()


def send(bench, days, epoch=1, torque_scale=1.0, position_scale=1.0):
    """One test run of the paper a day."""
    for day in days:
        torque, position = burst(AXIS, seed=day)
        start = START_NS + day * DAY_NS
        for block in blocks_of("axis-1", epoch, 2000 * (day - min(days)), start, torque * torque_scale,
                               position * position_scale, size=500):  # fmt: skip
            bench.put(block)


def test_per_mille_taken_for_newton_metres_is_refused_named_kept_and_lifted(tmp_path, workers):
    bench = Bench(tmp_path, workers, axes=(AXIS,), **WINDOWS)
    per_mille = 1000 / (AXIS.drive.rated_force / AXIS.mechanics.gain)  # object 0x6077 as it comes
    send(bench, range(3), epoch=1, torque_scale=per_mille)
    bench.finish()
    bench.step()
    told = bench.heard("parameters")
    assert [one["verdict"] for one in told] == ["bad_data"] * 3
    assert all("0x6077" in one["audit"]["findings"][0]["likely"] for one in told)
    alert = bench.heard("alerts")[0]
    assert (alert["kind"], alert["transition"]["after"]) == ("data_quality", "unacknowledged")
    assert "0x6077" in alert["alert"]["text"]
    status = bench.heard("status")[-1]
    assert status["audit"]["state"] == "refused"
    assert status["baseline"]["windows"] == 0
    with Reader(bench.url) as reader:
        assert reader.axis("axis-1").samples == 6000  # counted and kept
        assert reader.history("axis-1")["series"] == {}
    send(bench, range(3, 7), epoch=2)  # mended, and its publisher started anew
    bench.finish()
    bench.step()
    assert [one["verdict"] for one in bench.heard("parameters")[3:]] == ["identified"] * 4
    assert bench.heard("alerts")[-1]["transition"]["after"] == "returned_unacknowledged"
    status = bench.heard("status")[-1]
    assert status["audit"] == {"state": "passed", "refused": None}
    assert status["baseline"]["windows"] == 4


def test_a_position_that_turns_its_sign_in_the_middle_of_an_epoch_is_caught(tmp_path, workers):
    bench = Bench(tmp_path, workers, axes=(AXIS,), **WINDOWS)
    send(bench, range(4))
    bench.finish()
    bench.step()
    assert bench.heard("status")[-1]["audit"]["state"] == "passed"
    torque, position = burst(AXIS, seed=9)
    for block in blocks_of("axis-1", 1, 8000, START_NS + 9 * DAY_NS, torque, -1000 * position, size=500):
        bench.put(block)
    bench.finish()
    assert [one["verdict"] for one in bench.heard("parameters")] == ["identified"] * 4 + ["bad_data"]
    assert bench.heard("alerts")[-1]["kind"] == "data_quality"


def window(epoch=1, drive=1.0, travel=1.0, step_ns=STEP_NS, is_force=False, mean=0.0):
    phase = np.linspace(0, 20, 400)
    return Samples(
        epoch, 0, START_NS + np.arange(400) * step_ns, mean + drive * np.cos(phase), travel * np.sin(phase), is_force
    )


@pytest.mark.parametrize(
    "change", [{"epoch": 2}, {"drive": 4.0}, {"travel": 1000.0}, {"step_ns": STEP_NS // 10}, {"is_force": True}]
)
def test_what_may_be_another_unit_begins_the_audit_anew(change):
    assert not Signature.of(window(drive=1.5)).differs(Signature.of(window()))
    watch = AuditWatch()
    assert all(watch.due(window()) for _ in range(PASSES))
    watch.passes = PASSES
    assert not watch.due(window())
    assert watch.due(window(**change))


def test_a_mean_that_turns_its_sign_begins_the_audit_anew():
    assert Signature.of(window(mean=3.0)).differs(Signature.of(window(mean=-3.0)))


def test_without_a_refusal_findings_stay_as_they_are():
    found = [Finding(Kind.DATA_QUALITY, False), Finding(Kind.WEAR, True)]
    assert AuditWatch().quality(found) == found


# --- stamps and arrivals ----------------------------------------------------------------------------------------


def blocks(count, step_ns=STEP_NS, stride_ns=None, samples=100, start=START_NS):
    stride = samples * step_ns if stride_ns is None else stride_ns
    for k in range(count):
        stamps = start + k * stride + np.arange(samples) * step_ns
        yield Block("axis-1", 1, k * samples, stamps, np.zeros(samples), torque=np.zeros(samples), dt_ns=step_ns)


def heard(stream, every_ns, delay_ns=0):
    clock = StreamClock()
    for k, block in enumerate(stream):
        clock.note(block, START_NS + delay_ns + (k + 1) * every_ns)
    return clock


def test_a_live_stream_shows_its_skew_and_runs_at_the_speed_of_the_wall():
    clock = heard(blocks(20), 10**9, delay_ns=2 * 10**9)
    assert clock.live
    assert clock.skew == pytest.approx(2.01)
    assert clock.note_text is None


def test_stamps_of_a_clock_that_is_hours_ahead_are_noted():
    clock = heard(blocks(20, start=START_NS + 7200 * 10**9), 10**9)
    assert "ahead of our clock" in clock.note_text


def test_stamps_that_crawl_and_a_replay_are_told_apart():
    assert "slower than they arrive" in heard(blocks(20, step_ns=STEP_NS // 1000), 10**9).note_text
    replay = heard(blocks(40), 10**8)
    assert replay.note_text is None
    assert not replay.live


def test_samples_that_never_make_a_window_are_complained_of_with_the_reason(tmp_path, workers):
    bench = Bench(tmp_path, workers, axes=(AXIS,))
    for block in blocks(10, step_ns=STEP_NS // 1000, stride_ns=10**9):  # dt in us
        bench.put(block)
    bench.finish()
    bench.step()
    alert = bench.heard("alerts")[-1]
    assert alert["kind"] == "data_quality"
    assert "check dt_ns" in alert["alert"]["text"]
    assert bench.heard("status")[-1]["gaps"] == {"pause": 9}


def test_a_publisher_whose_epoch_is_too_old_is_not_refused_in_silence():
    hunger, clock = Starvation(), StreamClock()
    hunger.note(Outcome(old_epoch=199))
    assert hunger.complaint(200, clock) is None
    hunger.note(Outcome(old_epoch=1))
    assert "larger epoch" in hunger.complaint(200, clock)
    gap = Gap(GapKind.EPOCH, 1, 5, 5, 0, 1)
    hunger.note(Outcome(accepted=[window()], gaps=[gap]))
    assert hunger.complaint(200, clock) is None


def test_a_long_hop_is_no_hunger():
    hunger, clock = Starvation(taken=5000, breaks=collections.Counter({GapKind.PAUSE: 1})), StreamClock()
    assert hunger.complaint(200, clock, hop=5000) is None
    assert "jumps" in hunger.complaint(200, clock, hop=4000)
