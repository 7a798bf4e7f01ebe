"""What Zenoh says about links and messages that it refuses, read line by line. Pure.

Zenoh tells nobody but its own log, decision by decision. A message was refused where `Msg intercepted!` follows an
`unauthorized` of the same thread; where a key is new, decisions are made in advance and refuse nothing yet.
"""

from __future__ import annotations

import re
from collections import Counter, OrderedDict
from dataclasses import dataclass, field

WORDS = "off,zenoh_link_tls=debug,zenoh::net::routing::interceptor=trace"  # what is needed here of Zenoh's log
FORGOTTEN = 3600.0  # s after which a refusal is told as if it were the first
LOGGED = {10**k for k in range(18)}  # of many equal refusals
MOST = 1000  # names, and kinds of refusals, that are remembered

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_THREAD = re.compile(r"ThreadId\((\d+)\)")
_LINK = re.compile(r"zenoh_link_\w+::unicast: (.+?)\.? Hint: increase the system open file limit")
_OPENED = re.compile(r"Accepted \w+ connection on \S+: (\S+)\. Common Name: (.*)\.$")
_NO_ROLE = re.compile(r"access_control: (\w+) did not match any configured ACL subject")
_DECIDED = re.compile(
    r"access_control: (Using cached result: )?(\w+)(?: on (\S*))? is (un)?authorized to ([\w /]+) \((\w+)\) on (\S+)"
)
_AHEAD = re.compile(r"access_control: ACL \(\w+\): caching permissions for")
IN_ADVANCE = 9  # decisions about a new key, one for each kind of message
_NAME = re.compile(r"CertCommonName\((.*?)\)")


@dataclass(frozen=True, slots=True)
class Refusal:
    """Who was refused what, for the log; `fields` by name."""

    event: str
    fields: dict[str, str | int] = field(default_factory=dict)


class Refusals:
    """Reads Zenoh's lines; of many equal refusals within an hour it gives the 1st, 10th, 100th, ..., counted."""

    def __init__(self) -> None:
        """Nothing is known yet."""
        self._names: OrderedDict[str, str] = OrderedDict()  # by Zenoh's id of the other end
        self._opened: dict[str, tuple[str, str]] = {}  # by thread: address and certificate of its latest link
        self._decided: dict[str, tuple[str, str, str]] = {}  # by thread: id, what, key
        self._ahead: Counter[str] = Counter()  # by thread: decisions to come that are made in advance
        self._counts: Counter[tuple[str, ...]] = Counter()
        self._since = -float("inf")

    def read(self, line: str, now: float) -> Refusal | None:
        """The refusal that `line`, read at `now` [s], tells of; None for every other line."""
        line = _COLOURS.sub("", line)
        if now - self._since > FORGOTTEN or len(self._counts) > MOST:
            self._counts.clear()
            self._since = now
        found = _THREAD.search(line)
        thread = found[1] if found else ""
        if said := _DECIDED.search(line):
            self._decide(thread, said)
        elif _AHEAD.search(line):
            self._ahead[thread] = IN_ADVANCE
        elif "interceptor: Msg intercepted!" in line:
            return self._intercepted(thread)
        elif said := _LINK.search(line):
            return self._count("link refused", why=said[1].partition(": verification time")[0])
        elif said := _OPENED.search(line):
            self._opened[thread] = (said[1], said[2])
        elif said := _NO_ROLE.search(line):
            address, name = self._opened.get(thread, ("", said[1]))
            self._remember(said[1], name)
            return self._count("link without a role: all its messages are refused", certificate=name, client=address)
        return None

    def _decide(self, thread: str, said: re.Match[str]) -> None:
        """Keep what was decided, until it is known whether a message met it."""
        cached, who, subject, refused, what, flow, key = said.groups()
        if subject and (name := _NAME.search(subject)):
            self._remember(who, name[1])
        self._decided.pop(thread, None)
        if not cached and self._ahead[thread] > 0:
            self._ahead[thread] -= 1
            return
        self._ahead[thread] = 0
        if refused and flow == "ingress":
            self._decided[thread] = (who, what.lower(), key.partition("/@adv")[0])

    def _intercepted(self, thread: str) -> Refusal | None:
        self._ahead[thread] = 0
        if (decided := self._decided.pop(thread, None)) is None:
            return None
        who, what, key = decided
        return self._count("message refused", certificate=self._names.get(who, who), what=what, key=key)

    def _remember(self, who: str, name: str) -> None:
        self._names[who] = name
        if len(self._names) > MOST:
            self._names.popitem(last=False)

    def _count(self, event: str, **fields: str) -> Refusal | None:
        alike = (event, *(value for name, value in fields.items() if name != "client"))
        self._counts[alike] += 1
        count = self._counts[alike]
        return Refusal(event, {**fields, "count": count}) if count in LOGGED else None
