"""How far a diagnosis is, and how long it may still take: steps counted, those that may follow guessed. No clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identify.mismatch.progress import Doing

# In units of one candidate's fit in the first search, about, from `make diagnosis-course`.
BASELINE = 2.5  # the model of friction alone
OUTLOOK = 1.5  # before the fits of a search: which effects are worth one
CANDIDATES = 7.0  # of a search that has not begun
CONCLUSION = {"what is left": 5.0, "next experiment": 4.0, "changes since commissioning": 8.0}
SHARE = 0.5  # the share of an effect
USUAL = 2  # searches: one that finds an effect, one that finds no more


@dataclass(slots=True)
class Course:
    """Work done and work foreseen, in units of a fit.

    It foresees one search that finds an effect and one that finds no more; what is found shortens or lengthens that.

    Attributes:
        behind: done, without the step under way. [1]
        now: the step under way. [1]
        here: fits that follow in this search. [1]
        later: searches that usually follow, all their fits. [1]
        last: what is usually done after the searches. [1]
        searches: begun so far.
    """

    behind: float = 0.0
    now: float = BASELINE
    here: float = 0.0
    later: float = USUAL * (OUTLOOK + CANDIDATES)
    last: float = CONCLUSION["what is left"] + SHARE
    searches: int = 0

    def hear(self, doing: Doing) -> None:
        """A step begins; the one before has ended."""
        self.behind += self.now
        match doing.stage:
            case "search" | "test":
                if doing.done == 0:
                    self.behind += OUTLOOK
                    self.searches += doing.stage == "search"
                    self.later = max(USUAL - self.searches, 0) * (OUTLOOK + doing.of)
                self.now, self.here = 1.0, float(doing.of - doing.done - 1)
            case "conclusion":
                self.now = CONCLUSION.get(doing.what, SHARE)
                self.last = max(self.last - self.now, 0.0)
                self.here = self.later = 0.0

    @property
    def ahead(self) -> float:
        """What is not done, the step under way included. [1]."""
        return self.now + self.here + self.later + self.last

    def left(self, elapsed: float, since: float) -> float | None:
        """Seconds that remain if all goes as usual; None while nothing has been measured.

        Args:
            elapsed: since the beginning until this step began. [s]
            since: since this step began. [s]
        """
        return None if self.behind <= 0.0 else max(elapsed * self.ahead / self.behind - since, 0.0)


def in_words(left: float | None) -> str:
    """The time that is left, no finer than it is known."""
    if left is None:
        return ""
    if left < 5.0:
        return "a few seconds left"
    return f"about {5 * round(left / 5.0)} s left" if left < 90.0 else f"about {left / 60.0:.0f} min left"
