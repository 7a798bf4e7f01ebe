"""The part of a daemon that a replay waits for: it takes every block of a site and acknowledges it."""

import contextlib
import json

import zenoh
import zenoh.ext

from plant import keys
from plant.wire import decode_block


@contextlib.contextmanager
def committing(session, site="plant-1"):
    """Acknowledge whatever comes; yields the blocks. Hears as the daemon does: what a busy link drops is recovered."""
    blocks = []

    def commit(sample):
        block = decode_block(sample.payload.to_bytes(), str(sample.encoding))
        blocks.append(block)
        committed = {"epoch": block.epoch, "seq": block.seq + len(block) - 1}
        status = json.dumps({"schema_version": 1, "axis": block.axis, "committed": committed})
        session.put(keys.status_key(site, block.axis), status, congestion_control=zenoh.CongestionControl.BLOCK)

    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        keys.samples_pattern(site),
        commit,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
    yield blocks
    subscriber.undeclare()
