"""Errors of the monitor package; the tree continues `plant.errors`.

::

    TribowatchError
    |- InputError                  exit code 2
    |  |- ConfigError              configuration: unknown key, wrong type, contradiction
    |  `- QueryError               a question that cannot be answered as asked: unknown axis, bad time
    `- ReachError                  exit code 3
       |- DatabaseError            history that cannot be opened, read or written
       |- AlreadyRunningError      another daemon owns the state directory
       `- FencedError              another daemon has taken over an axis of ours
"""

from __future__ import annotations

from plant.errors import InputError, ReachError


class ConfigError(InputError):
    """The configuration cannot be used: names file, key, and the nearest allowed key."""


class QueryError(InputError):
    """A query that cannot be answered as asked."""


class DatabaseError(ReachError):
    """The history database cannot be opened, read or written."""


class AlreadyRunningError(ReachError):
    """Another daemon owns the state directory."""


class FencedError(ReachError):
    """Another daemon that shares the site's axes has taken over; nothing was written."""
