"""Errors of the plant package.

::

    TribowatchError            anything a user can mend; its text is one clear line
    |- InputError              unreadable or contradictory input (exit code 2)
    |  |- ParameterError       a value out of range: names field, value, range and unit
    |  |- AxisFileError        axis.toml: unknown key, wrong type, missing value
    |  |- RecordingError       a recording that cannot be read
    |  `- PayloadError         a stream block that is not the documented payload
    `- ReachError              a service, port or database that cannot be reached (exit code 3)
"""

from __future__ import annotations


class TribowatchError(Exception):
    """Something a user can mend: the text says what, where, the value with its unit, and what to do."""


class InputError(TribowatchError):
    """Unreadable or contradictory input; the command exits with 2."""


class ParameterError(InputError):
    """A value out of its range."""

    def __init__(self, field: str, value: object, allowed: str, unit: str = "1") -> None:
        """Compose the line from `field`, its `value`, what is `allowed` and the `unit` of both."""
        shown = f"{value:g}" if isinstance(value, float) else f"{value}"
        suffix = "" if unit in ("", "1") else f" {unit}"
        super().__init__(f"{field} is {shown}{suffix}, but must be {allowed}{suffix}")
        self.field, self.value, self.allowed, self.unit = field, value, allowed, unit


class AxisFileError(InputError):
    """An axis file with an unknown key, a wrong type or a missing value."""


class RecordingError(InputError):
    """A recording that cannot be read: no file, unparsable, missing column."""


class PayloadError(InputError):
    """A stream block that is not the documented payload; `reason` is a short countable word."""

    def __init__(self, reason: str, message: str) -> None:
        """Keep `reason` for the counters and `message` for the log."""
        super().__init__(message)
        self.reason = reason


class ReachError(TribowatchError):
    """A service, port or database that cannot be reached; the command exits with 3."""
