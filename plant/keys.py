"""Key names on Zenoh: `<prefix>/<site>/<axis>/<what>`, and who is alive."""

from __future__ import annotations

import re

from plant.axis import AXIS_NAME
from plant.errors import ParameterError

PREFIX = "tribowatch"
ALIVE = "alive"
SAMPLES = "samples"
BRIDGE = "bridge"
OUTPUTS = ("parameters", "model", "alerts", "mismatch", "status")
HISTORIES = ("parameters", "alerts", "events", "versions", "kpi")
COMMAND = "command"


def check_id(kind: str, name: str) -> str:
    """Return `name` when it may stand in a key as a `kind` ("site", "axis", ...).

    Raises:
        ParameterError: other characters than letters, digits, '_', '.', '-', too long, or the reserved `alive`.
    """
    if not re.fullmatch(AXIS_NAME, name) or name == ALIVE:
        raise ParameterError(kind, repr(name), "1-40 of A-Z a-z 0-9 _ . -, a letter or digit first, and not 'alive'")
    return name


def _check_prefix(prefix: str) -> str:
    for chunk in prefix.split("/"):
        check_id("key prefix", chunk)
    return prefix


def _key(prefix: str, site: str, *rest: str) -> str:
    return "/".join((_check_prefix(prefix), check_id("site", site), *rest))


def samples_key(site: str, axis: str, prefix: str = PREFIX) -> str:
    """Key of an axis' stream, the only one a publisher of samples may put to."""
    return _key(prefix, site, check_id("axis", axis), SAMPLES)


def samples_pattern(site: str, prefix: str = PREFIX) -> str:
    """Key expression that receives the streams of all axes of `site`."""
    return _key(prefix, site, "*", SAMPLES)


def output_key(site: str, axis: str, what: str, prefix: str = PREFIX) -> str:
    """Key of one of the daemon's `OUTPUTS` for an axis."""
    if what not in OUTPUTS:
        raise ParameterError("output", what, " | ".join(OUTPUTS))
    return _key(prefix, site, check_id("axis", axis), what)


def parameters_key(site: str, axis: str, prefix: str = PREFIX) -> str:
    """Key of the latest identified parameters."""
    return output_key(site, axis, "parameters", prefix)


def status_key(site: str, axis: str, prefix: str = PREFIX) -> str:
    """Key of the axis' status: samples, gaps, rejects, and the seq that is committed."""
    return output_key(site, axis, "status", prefix)


def bridge_key(site: str, name: str, prefix: str = PREFIX) -> str:
    """Key of the status of a bridge: what it counted of its bus."""
    return _key(prefix, site, check_id("bridge", name), BRIDGE)


def history_key(site: str, axis: str, what: str, prefix: str = PREFIX) -> str:
    """Key of a queryable of `HISTORIES`, like `history/parameters`."""
    if what not in HISTORIES:
        raise ParameterError("history", what, " | ".join(HISTORIES))
    return _key(prefix, site, check_id("axis", axis), "history", what)


def command_key(site: str, axis: str, prefix: str = PREFIX) -> str:
    """Key of the queryable that takes an operator's commands for an axis."""
    return _key(prefix, site, check_id("axis", axis), COMMAND)


def alive_key(site: str, who: str, prefix: str = PREFIX) -> str:
    """Liveliness token of `who` ("daemon", a bridge, a simulator)."""
    return _key(prefix, site, ALIVE, check_id("who", who))


def alive_pattern(site: str, prefix: str = PREFIX) -> str:
    """Key expression of everybody's liveliness on `site`."""
    return _key(prefix, site, ALIVE, "*")


def axis_of(key: str, prefix: str = PREFIX) -> tuple[str, str]:
    """Site and axis named by a key `<prefix>/<site>/<axis>/...`.

    Raises:
        ParameterError: the key does not begin with `prefix`, or an id in it is not allowed.
    """
    chunks = key.removeprefix(f"{prefix}/").split("/")
    if not key.startswith(f"{prefix}/") or len(chunks) < 3:
        raise ParameterError("key", repr(key), f"{prefix}/<site>/<axis>/<what>")
    return check_id("site", chunks[0]), check_id("axis", chunks[1])
