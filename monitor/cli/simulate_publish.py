"""`tribowatch simulate --publish`: the bursts of a scenario on Zenoh, no further ahead than its listener can follow."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plant.scenario import Burst, Scenario

LEASH = 100_000  # samples on their way unacknowledged: less than the publisher's cache, so that none is lost
STALL = 5.0  # s without news, after which nobody is waited for
ANSWER_STALL = 30.0  # s the same for answers: the first one waits for processes that load their numerics


def publish(
    machine: Scenario,
    chosen: range,
    speed: float,
    connect: list[str],
    site: str,
    prefix: str,
    ahead: int | None,
    step: Callable[[Burst], object],
) -> dict[str, Any]:
    """Send the bursts to a Zenoh session.

    Args:
        machine: what happens.
        chosen: numbers of the bursts.
        speed: event seconds per second. [1]
        connect: Zenoh endpoints.
        site: of the key.
        prefix: of the key.
        ahead: bursts that may be without an answer of the daemon; None waits for no answers.
        step: told of each burst.
    """
    from plant.acknowledgement import Acknowledgements
    from plant.answers_zenoh import Answers
    from plant.keys import samples_key
    from plant.publisher import SamplePublisher
    from plant.simulator import publish_scenario
    from plant.zenoh_session import open_session

    key, name = samples_key(site, machine.axis.name, prefix), machine.axis.name
    with (
        open_session("client", connect=tuple(connect)) as session,
        SamplePublisher(session, site, name, prefix=prefix) as sink,
        Acknowledgements(session, site, name, sink.epoch, prefix) as acknowledgements,
        Answers(session, site, name, prefix) as answers,
    ):
        receiver = _Patient(lambda: acknowledgements.committed, acknowledgements.wait_beyond, STALL)
        identified = _Patient(lambda: answers.until_ns, answers.wait_beyond, ANSWER_STALL)
        unanswered: deque[int] = deque()

        def after(burst: Burst) -> None:
            step(burst)
            receiver.wait(sink.next_seq - LEASH)
            if ahead is not None:
                unanswered.append(burst.begin_ns)
                while len(unanswered) > ahead:
                    identified.wait(unanswered.popleft())

        sent = publish_scenario(machine, sink, speed=speed, first=chosen.start, last=chosen.stop, on_burst=after)
        committed = receiver.wait(sink.next_seq - 1)
    return {"key": key, "speed": speed, **dataclasses.asdict(sent), "committed_seq": committed}


class _Patient:
    """Waits for whoever listens; one that has been silent for `patience` [s] is not waited for until it speaks."""

    def __init__(self, now: Callable[[], int], beyond: Callable[[int, float], int], patience: float) -> None:
        self._now, self._beyond, self._patience = now, beyond, patience
        self._silent_at: int | None = None

    def wait(self, until: int) -> int:
        """Wait until `until` is reached or the other side falls silent; return what is reached."""
        reached = self._now()
        while reached < until and reached != self._silent_at:
            news = self._beyond(reached, self._patience)
            if news == reached:
                self._silent_at = reached
            reached = news
        return reached
