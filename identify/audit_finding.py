"""What an audit finds: a value with its reason."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Literal

Severity = Literal["ok", "warn", "refuse"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One check of a recording against its axis.

    Attributes:
        severity: ok; warn: look at it; refuse: what is identified from this would be wrong.
        check: short name, countable.
        seen: what was found, with unit.
        expected: what should have been, with unit.
        likely: the likely cause and its remedy, None where none is known.
        text: all of it as one sentence.
    """

    severity: Severity
    check: str
    seen: str
    expected: str
    likely: str | None
    text: str

    @property
    def bad(self) -> bool:
        """Whether there is anything against the recording."""
        return self.severity != "ok"

    def to_dict(self) -> dict[str, str | None]:
        """The finding as JSON."""
        return asdict(self)


def worst(findings: Iterable[Finding]) -> Severity:
    """The gravest severity among `findings`."""
    found = {finding.severity for finding in findings}
    return "refuse" if "refuse" in found else "warn" if "warn" in found else "ok"
