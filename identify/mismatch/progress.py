"""What a diagnosis is doing, so that whoever waits can be told how long it may still take. Values only, no clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class Stage(StrEnum):
    """Parts of a diagnosis, in their order; `SEARCH` comes once for each effect looked for, `TEST` may not come."""

    BASELINE = "baseline"
    SEARCH = "search"
    TEST = "test"
    CONCLUSION = "conclusion"


@dataclass(frozen=True, slots=True)
class Doing:
    """One step that begins now.

    Attributes:
        stage: which part of the diagnosis.
        what: is being done, a few words or the name of an effect.
        done, of: steps of this search that are behind, and that it has in all. [1]
    """

    stage: Stage
    what: str
    done: int = 0
    of: int = 1


Tell = Callable[[Doing], None]


def unheard(_: Doing) -> None:
    """Nobody waits."""
