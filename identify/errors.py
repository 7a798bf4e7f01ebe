"""Errors of the identify package: those of plant, under the names this package raises.

::

    TribowatchError
    `- InputError              unknown method, window outside the recording (exit code 2)

Samples that can be read but not used are no errors: they are the verdict `bad_data` with its reason.
"""

from __future__ import annotations

from plant.errors import InputError, ParameterError, TribowatchError

__all__ = ["InputError", "ParameterError", "TribowatchError"]
