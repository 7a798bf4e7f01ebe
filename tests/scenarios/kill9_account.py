"""The account of `kill9`: every sample, window, answer and alarm, from the database alone."""

import collections
import itertools

import numpy as np
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from monitor.database import make_engine
from tests.scenarios.harness import STEP_NS

WRONG = ("unaccounted", "both_received_and_missing", "received_twice", "acknowledged_and_lost", "never_sent",
         "windows_twice", "windows_wrong", "answers_missing", "transitions_lost", "transitions_illegal",
         "alarms_elsewhere", "commands_lost")  # fmt: skip
ASIDE = ("shelved", "suppressed", "out_of_service")
LEGAL = {
    ("normal", "unacknowledged"), ("unacknowledged", "acknowledged"), ("unacknowledged", "returned_unacknowledged"),
    ("unacknowledged", "normal"), ("acknowledged", "normal"), ("returned_unacknowledged", "normal"),
    ("returned_unacknowledged", "unacknowledged"), ("suppressed", "normal"), ("suppressed", "unacknowledged"),
    ("normal", "suppressed"),
}  # fmt: skip  # docs/alerts.md, without what only an operator does and nobody does here


class Database:
    """The history at `url`, read afresh each time: its server may have died since."""

    def __init__(self, url: str) -> None:
        self.url = url

    def query(self, sql, **values):
        engine = make_engine(self.url)
        try:
            with engine.connect() as connection:
                return [tuple(row) for row in connection.execute(text(sql), values)]
        finally:
            engine.dispose()

    def received(self, epoch):
        """Numbers of the samples in the journal, in order, each as often as it is there."""
        rows = self.query("select seq, n from block where epoch = :epoch order by seq", epoch=epoch)
        return np.concatenate([np.arange(seq, seq + n) for seq, n in rows] or [np.zeros(0, dtype=int)])

    def missing(self, epoch):
        """Numbers of the samples that are reported as missing."""
        sql = "select from_seq, to_seq from gap where epoch = :epoch and missing > 0"
        parts = [np.arange(first, end) for first, end in self.query(sql, epoch=epoch)]
        return np.concatenate(parts or [np.zeros(0, dtype=int)])

    def transitions(self):
        """(id, kind, event, before, after, at_ns), oldest first."""
        return self.query("select id, kind, event, before, after, at_ns from transition order by id")

    def integrity(self) -> str:
        """ok, or what the database's own check says; PostgreSQL: `amcheck` of every table and index of ours."""
        if not self.url.startswith("postgresql"):
            return self.query("pragma integrity_check")[0][0]
        tables = """select string_agg(c.relname || ': ' || v.msg, '; ')
            from pg_class c cross join lateral public.verify_heapam(c.oid) v
            where c.relkind = 'r' and c.relnamespace = current_schema::regnamespace"""
        indexes = """select count(public.bt_index_check(c.oid, true)::text)
            from pg_class c join pg_am on pg_am.oid = c.relam and amname = 'btree'
            where c.relkind = 'i' and c.relnamespace = current_schema::regnamespace"""
        engine = make_engine(self.url)
        try:
            with engine.begin() as connection:
                connection.execute(text("create extension if not exists amcheck schema public"))
                broken = connection.execute(text(tables)).scalar_one()
                checked = connection.execute(text(indexes)).scalar_one()
        except DBAPIError as error:
            return str(error.orig)
        finally:
            engine.dispose()
        return broken or ("ok" if checked else "no index was checked")


def promise(database, acknowledged):
    """What the daemon had said by the kill: (epoch, samples of the journal up to there), and its alarms' past."""
    epoch, last = acknowledged
    numbers = database.received(epoch)
    return epoch, numbers[numbers <= last], database.transitions()


def account(database, ledger, promises, acknowledged_commands) -> dict:
    """Compare journal, gaps, windows and alarms with what was sent, acknowledged and told."""
    total = collections.Counter(dict.fromkeys(WRONG, 0))
    for epoch, (sent, _) in ledger.items():
        total.update(_samples(database, epoch, sent, epoch == max(ledger)))
        mine = [numbers for promised, numbers, _ in promises if promised == epoch]
        numbers = np.unique(database.received(epoch))
        total["acknowledged_and_lost"] += sum(len(np.setdiff1d(one, numbers)) for one in mine)
    answers, answered = database.query("select count(*), count(distinct window_id) from estimate")[0]
    total["answers_missing"] = total["windows"] - answered
    total.update(_alarms(database, promises, acknowledged_commands))
    given_up = "select count(*) from estimate where reason like 'its worker process%'"
    return dict(total) | {
        "epochs": len(ledger),
        "answers": answers,
        "windows_given_up": database.query(given_up)[0][0],
        "integrity": database.integrity(),
    }


def _samples(database, epoch, sent, alive):
    """One epoch. What a killed publisher sent last may never have left it, and then nobody can know of it."""
    every, missing = database.received(epoch), database.missing(epoch)
    numbers = np.unique(every)
    known = np.union1d(numbers, missing)
    end = sent if alive else (known[-1] + 1 if len(known) else 0)
    expected = [(int(first),) for first in _expected_windows(database, epoch, numbers)]
    windows = database.query('select first_seq from "window" where epoch = :epoch', epoch=epoch)
    return {
        "sent": sent,
        "received": len(numbers),
        "missing_reported": len(missing),
        "died_with_their_publisher": int(sent - end),
        "unaccounted": int(end - len(known[known < end])),
        "never_sent": int((known >= sent).sum()),
        "received_twice": len(every) - len(numbers),
        "both_received_and_missing": len(np.intersect1d(numbers, missing)),
        "windows": len(windows),
        "windows_twice": len(windows) - len(set(windows)),
        "windows_wrong": len(set(windows) ^ set(expected)),
    }


def _expected_windows(database, epoch, numbers, samples=1000, hop=800):
    """First samples of the windows that the received samples make, from the journal alone."""
    rows = database.query("select t_ns from block where epoch = :epoch order by seq", epoch=epoch)
    stamps = np.concatenate([np.frombuffer(t_ns, "<i8") for (t_ns,) in rows] or [np.zeros(0, dtype=int)])
    if not len(stamps):
        return []
    broken = (np.diff(numbers) != 1) | (np.diff(stamps) > 1.5 * STEP_NS)
    edges = np.concatenate(([0], np.flatnonzero(broken) + 1, [len(numbers)]))
    starts = []
    for first, end in itertools.pairwise(edges):
        starts += [numbers[k] for k in range(first, end - samples + 1, hop)]
    return starts


def _alarms(database, promises, acknowledged_commands):
    """Each alarm's past before a kill is the beginning of its past now, unbroken, and it is where that leads."""
    rows = database.transitions()
    stored = set(rows)
    lost = sum(len(set(past) - stored) for *_, past in promises)
    state: dict[str, str] = {}
    illegal = 0
    for _, kind, _, before, after, _ in rows:
        illegal += before != state.get(kind, "normal") or (before, after) not in LEGAL
        state[kind] = after
    now = dict(database.query("select kind, state from alarm"))
    return {
        "transitions": len(rows),
        "transitions_lost": lost,
        "transitions_illegal": illegal,
        "alarms_elsewhere": sum(state.get(kind, "normal") != where for kind, where in now.items()),
        "commands": acknowledged_commands,
        "commands_lost": max(0, acknowledged_commands - sum(event == "acknowledge" for _, _, event, *_ in rows)),
    } | {f"raised_{kind}": sum(one[1] == kind and one[4] == "unacknowledged" for one in rows) for kind in state}
