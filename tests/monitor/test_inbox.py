"""The queue between Zenoh's threads and ours: bounded in messages and in bytes, and what does not fit is counted."""

import threading
import time

from monitor.inbox import PATIENCE, Inbox, Message


def message(size=1, key="a"):
    return Message(key, "application/cbor", bytes(size), 0.0)


def test_payloads_together_are_bounded_and_the_room_comes_back():
    inbox = Inbox(100, most_bytes=1000)
    for _ in range(5):
        inbox.put(message(300))
    taken, dropped = inbox.take(2, 0.0)
    assert (len(taken), dropped) == (2, {"a": 2})
    inbox.put(message(600))
    inbox.put(message(200))
    assert len(inbox) == 2
    assert inbox.take(10, 0.0)[1] == {"a": 1}
    inbox.put(message(1000))
    assert [len(one.payload) for one in inbox.take(10, 0.0)[0]] == [1000]


def test_small_ones_pass_where_a_big_one_does_not():
    inbox = Inbox(100, most_bytes=10)
    inbox.put(message(11, "big"))
    inbox.put(message(1, "small"))
    taken, dropped = inbox.take(10, 0.0)
    assert [one.key for one in taken] == ["small"]
    assert dropped == {"big": 1}


def test_while_the_consumer_is_at_work_a_flood_waits_and_nothing_is_dropped():
    inbox, count = Inbox(10), 2000
    flood = threading.Thread(target=lambda: [inbox.put(message(1, str(k))) for k in range(count)])
    inbox.take(10, 0.0)
    flood.start()
    keys, lost = [], {}
    while flood.is_alive() or len(inbox):
        taken, dropped = inbox.take(3, 0.01)
        keys += [one.key for one in taken]
        lost |= dropped
    flood.join()
    assert lost == {}
    assert keys == [str(k) for k in range(count)]


def test_a_consumer_that_hangs_delays_the_flood_once():
    inbox = Inbox(1)
    begun = time.monotonic()
    for _ in range(1000):
        inbox.put(message())
    assert time.monotonic() - begun < 100 * PATIENCE  # not a thousand times
    assert inbox.take(10, 0.0)[1] == {"a": 999}


def test_the_end_of_a_fetch_always_has_room_and_waits_for_none():
    inbox = Inbox(1)
    inbox.put(message())
    begun = time.monotonic()
    inbox.put(Message("a", "", b"", 0.0, complete=True))
    assert time.monotonic() - begun < PATIENCE
    taken, dropped = inbox.take(10, 0.0)
    assert [one.complete for one in taken] == [False, True]
    assert dropped == {}
