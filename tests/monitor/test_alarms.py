"""The alarm's life, state by state and event by event."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from monitor.alarms import ASIDE, Alarm, AlarmRule, Event, State, advance

RULE = AlarmRule()
N, U, A, R = State.NORMAL, State.UNACKNOWLEDGED, State.ACKNOWLEDGED, State.RETURNED_UNACKNOWLEDGED
SH, SU, OUT = State.SHELVED, State.SUPPRESSED, State.OUT_OF_SERVICE

# state (with its condition) x event -> state after ISA-18.2 / IEC 62682; what is not listed stays
STEPS = {
    (N, False): {Event.HOLDS: U, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (U, True): {Event.GONE: R, Event.ACKNOWLEDGE: A, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (A, True): {Event.GONE: N, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (R, False): {Event.HOLDS: U, Event.ACKNOWLEDGE: N, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (SH, True): {Event.UNSHELVE: U, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (SH, False): {Event.UNSHELVE: N, Event.SHELVE: SH, Event.SUPPRESS: SU, Event.REMOVE: OUT},
    (SU, True): {Event.UNSUPPRESS: U, Event.REMOVE: OUT},
    (SU, False): {Event.UNSUPPRESS: N, Event.REMOVE: OUT},
    (OUT, True): {Event.RETURN: U},
    (OUT, False): {Event.RETURN: N},
}


@pytest.mark.parametrize("event", Event)
@pytest.mark.parametrize(("state", "active"), STEPS)
def test_every_state_and_event(state, active, event):
    before = Alarm(state, since_ns=5, active=active)
    after, transition = advance(before, event, 9, RULE)
    wanted = STEPS[state, active].get(event)
    assert after.state is (wanted or state)
    if wanted is None:
        assert transition is None
        assert after.since_ns == 5
    else:
        assert transition is not None
        assert (transition.before, transition.after, transition.event, transition.at_ns) == (state, wanted, event, 9)
        assert after.since_ns == 9


def follow(alarm, events, rule=RULE, step=10):
    """States after each event, `step` ns apart."""
    states = []
    for now, event in enumerate(events):
        alarm, _ = advance(alarm, event, now * step, rule)
        states.append(alarm.state)
    return states


def test_acknowledging_twice_changes_nothing_the_second_time():
    assert follow(Alarm(), [Event.HOLDS, Event.ACKNOWLEDGE, Event.ACKNOWLEDGE]) == [U, A, A]


def test_the_on_delay_counts_windows_in_a_row():
    rule = AlarmRule(on_count=3)
    h, g = Event.HOLDS, Event.GONE
    assert follow(Alarm(), [h, h, g, h, h, h], rule) == [N, N, N, N, N, U]


def test_the_off_delay_counts_windows_in_a_row():
    rule = AlarmRule(off_count=2)
    h, g = Event.HOLDS, Event.GONE
    assert follow(Alarm(), [h, g, h, g, g], rule) == [U, U, U, U, R]


def test_delays_in_event_time():
    rule = AlarmRule(on_delay_ns=25)
    assert follow(Alarm(), [Event.HOLDS] * 4, rule) == [N, N, N, U]  # at 0, 10, 20, 30 ns


def test_m_of_the_latest_n_observations_count():
    rule = AlarmRule(on_count=2, on_of=4, off_count=2, off_of=3)
    h, g = Event.HOLDS, Event.GONE
    assert follow(Alarm(), [h, g, g, h, g, h, g, g], rule) == [N, N, N, U, U, U, R, R]
    assert follow(Alarm(), [h, g, g, g, h, g], rule) == [N] * 6  # two of five are not two of four


def test_a_clock_that_steps_back_delays_and_never_raises_early():
    rule = AlarmRule(on_delay_ns=25)
    alarm, states = Alarm(), []
    for now in (100, 110, 20, 30, 44, 45):
        alarm, _ = advance(alarm, Event.HOLDS, now, rule)
        states.append(alarm.state)
    assert states == [N, N, N, N, N, U]


def test_a_shelf_ends_by_the_wall_clock_where_the_stream_stopped():
    alarm, _ = advance(Alarm(A, active=True), Event.SHELVE, 0, RULE, until_ns=100, until_wall_ns=1000)
    assert advance(alarm, Event.TICK, 99, RULE, wall_ns=999)[0].state is SH
    back, transition = advance(alarm, Event.TICK, 99, RULE, wall_ns=1000)
    assert (back.state, back.until_wall_ns, transition.at_ns) == (U, None, 99)
    assert advance(alarm, Event.HOLDS, -500, RULE, wall_ns=901)[0].state is SH  # the event clock stepped back


def test_a_shelf_can_be_made_longer_and_shorter_and_each_time_is_audited():
    alarm, _ = advance(Alarm(U, active=True), Event.SHELVE, 0, RULE, until_ns=100)
    longer, transition = advance(alarm, Event.SHELVE, 50, RULE, until_ns=500)
    assert (transition.before, transition.after, longer.until_ns) == (SH, SH, 500)
    assert advance(longer, Event.TICK, 120, RULE)[0].state is SH


def test_shelving_expires():
    alarm, _ = advance(Alarm(U, active=True), Event.SHELVE, 0, RULE, until_ns=100)
    assert advance(alarm, Event.TICK, 99, RULE)[0].state is SH
    assert advance(alarm, Event.TICK, 100, RULE)[0].state is U
    gone, _ = advance(alarm, Event.GONE, 50, RULE)
    assert advance(gone, Event.TICK, 100, RULE)[0].state is N


def test_a_latched_alarm_waits_for_the_operator():
    rule = AlarmRule(latch=True)
    alarm, _ = advance(Alarm(U, active=True), Event.GONE, 1, rule)
    assert alarm.state is U
    assert advance(alarm, Event.ACKNOWLEDGE, 2, rule)[0].state is N


def test_time_alone_changes_nothing():
    for state, active in STEPS:
        before = Alarm(state, active=active)
        assert advance(before, Event.TICK, 10**18, RULE) == (before, None)


@given(st.lists(st.sampled_from(Event), max_size=40), st.integers(1, 3), st.integers(1, 3), st.booleans())
def test_no_history_leads_astray(events, on, off, latch):
    alarm, rule = Alarm(), AlarmRule(on_count=on, off_count=off, on_of=on + 1, latch=latch)
    for now, event in enumerate(events):
        before = alarm
        alarm, transition = advance(alarm, event, now, rule)
        moved = alarm.state is not before.state or (event is Event.SHELVE and alarm.state is SH)
        assert (transition is not None) == moved
        if alarm.state in (U, A):
            assert alarm.active or latch
        if alarm.state in (N, R):
            assert not alarm.active
        if before.state in ASIDE and event in (Event.HOLDS, Event.GONE, Event.ACKNOWLEDGE):
            assert alarm.state is before.state  # put aside means put aside
