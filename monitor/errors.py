"""Errors of the monitor package; the tree continues `plant.errors`.

::

    TribowatchError
    |- InputError                  exit code 2
    |  |- ConfigError              configuration: unknown key, wrong type, contradiction
    |  |- TokenError               the page's tokens cannot be read, made or taken back
    |  `- QueryError               a question that cannot be answered as asked: bad time, bad number
    |     `- UnknownError          it asks for something that is not there: axis, parameter, diagnosis
    `- ReachError                  exit code 3
       |- DatabaseError            history that cannot be opened, read or written
       |- AlreadyRunningError      another daemon owns the state directory
       |- FencedError              another daemon has taken over an axis of ours
       `- PageError                the page cannot listen where it should
"""

from __future__ import annotations

from plant.errors import InputError, ReachError


class ConfigError(InputError):
    """The configuration cannot be used: names file, key, and the nearest allowed key."""


class QueryError(InputError):
    """A query that cannot be answered as asked."""


class UnknownError(QueryError):
    """A query for something that is not there."""


class TokenError(InputError):
    """The tokens of the page cannot be read, made or taken back."""


class DatabaseError(ReachError):
    """The history database cannot be opened, read or written."""


class AlreadyRunningError(ReachError):
    """Another daemon owns the state directory."""


class FencedError(ReachError):
    """Another daemon that shares the site's axes has taken over; nothing was written."""


class PageError(ReachError):
    """The page cannot listen where the configuration says."""
