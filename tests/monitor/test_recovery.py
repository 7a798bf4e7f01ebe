"""What is missing of an axis is asked of its publishers' caches, over Zenoh on loopback."""

import threading

from monitor import recovery_zenoh
from monitor.inbox import Inbox
from monitor.recovery_zenoh import Recovery
from plant import keys
from plant.publisher import SamplePublisher
from plant.wire import decode_block
from plant.zenoh_session import open_session
from tests.scenarios.harness import START_NS, blocks_of, free_port, wait_for

KEY = keys.samples_key("s", "axis-1")


def drained(inbox):
    messages = []

    def ended():
        messages.extend(inbox.take(1000, 0.05)[0])
        return messages and messages[-1].complete

    wait_for(ended, 20, "the end of the fetch")
    return messages


def test_a_cache_is_fetched_whole_and_its_end_is_told():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    blocks = list(blocks_of("axis-1", 1, 0, START_NS, [0.5] * 500, [0.1] * 500))
    with (
        open_session("peer", listen=[endpoint]) as daemon,
        open_session("client", connect=[endpoint]) as machine,
        SamplePublisher(machine, "s", "axis-1", epoch=1) as publisher,
    ):
        for block in blocks:
            publisher.put(block)
        inbox = Inbox(1000)
        recovery = Recovery(daemon, inbox)

        def complete():
            assert recovery.fetch(KEY)
            return [one for one in drained(inbox) if not one.complete]

        messages = wait_for(complete, 20, "the cache to be known")
        assert {message.key for message in messages} == {KEY}
        assert [decode_block(one.payload, one.encoding).seq for one in messages] == [0, 100, 200, 300, 400]
        assert recovery.fetch(keys.samples_key("s", "axis-2"))
        assert drained(inbox)[-1].complete  # nobody has it


def test_no_more_caches_are_asked_at_once_than_allowed(monkeypatch):
    monkeypatch.setattr(recovery_zenoh, "AT_ONCE", 1)
    endpoint, answer = f"tcp/127.0.0.1:{free_port()}", threading.Event()
    with open_session("peer", listen=[endpoint]) as daemon, open_session("client", connect=[endpoint]) as machine:
        slow = machine.declare_queryable(f"{KEY}/@adv/**", lambda _: answer.wait(10.0))
        inbox = Inbox(100)
        recovery = Recovery(daemon, inbox)
        # until the slow cache is known, a fetch ends at once and the next one may begin
        wait_for(lambda: recovery.fetch(KEY) and not recovery.fetch(KEY), 20, "a fetch to be under way")
        answer.set()
        wait_for(lambda: recovery.fetch(KEY), 20, "the fetch to end")
        slow.undeclare()


def test_a_session_that_is_closed_ends_the_fetch_at_once():
    session = open_session("peer", listen=[f"tcp/127.0.0.1:{free_port()}"])
    inbox = Inbox(10)
    recovery = Recovery(session, inbox)
    session.close()
    assert recovery.fetch(KEY)
    assert drained(inbox)[-1].complete
