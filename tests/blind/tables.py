"""Tables of a study: every rate with its 95 % interval (Wilson), as Markdown and as JSON."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.blind.scoring import SEVERITIES, SIZES, Score

EXTRA = {"wrong", "extra", "one_and_wrong"}
CLEAR = ("clear", "strong")
OURS = "tribowatch"


@dataclass(frozen=True)
class Rate:
    """How often something happened."""

    name: str
    hits: int
    total: int

    @classmethod
    def of(cls, name: str, hits: Iterable[bool]) -> Rate:
        """Count."""
        found = [bool(hit) for hit in hits]
        return cls(name, sum(found), len(found))

    @property
    def words(self) -> str:
        """Rate, interval, counts."""
        if not self.total:
            return "-"
        low, high = wilson(self.hits, self.total)
        return f"{self.hits / self.total:.1%} [{low:.0%}, {high:.0%}] {self.hits}/{self.total}"

    def to_dict(self) -> dict[str, Any]:
        """JSON."""
        low, high = wilson(self.hits, self.total)
        return {"name": self.name, "hits": self.hits, "total": self.total, "low": low, "high": high}


@dataclass(frozen=True)
class Section:
    """A table: a title, columns, and rows of rates; `lines` stand below it."""

    title: str
    columns: tuple[str, ...] = ("rate [95 %] count",)
    rows: tuple[tuple[str, tuple[Rate, ...]], ...] = ()
    lines: tuple[str, ...] = field(default=())

    def markdown(self) -> str:
        """The section as text."""
        text = [f"## {self.title}", ""]
        if self.rows:
            text += [f"| | {' | '.join(self.columns)} |", "|---" * (1 + len(self.columns)) + "|"]
            text += [f"| {name} | {' | '.join(one.words for one in rates)} |" for name, rates in self.rows]
            text += [""]
        return "\n".join([*text, *self.lines, *([""] if self.lines else [])])

    def to_dict(self) -> dict[str, Any]:
        """JSON."""
        rows = [
            {"name": name, **dict(zip(self.columns, (r.to_dict() for r in rates), strict=True))}
            for name, rates in self.rows
        ]
        return {"title": self.title, "rows": rows, "lines": list(self.lines)}


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """95 % interval of a rate; (0, 1) of nothing."""
    if total == 0:
        return 0.0, 1.0
    rate, shrink = hits / total, 1.0 + z * z / total
    middle = (rate + z * z / (2 * total)) / shrink
    half = z * math.sqrt(rate * (1 - rate) / total + z * z / (4 * total * total)) / shrink
    return max(0.0, middle - half), min(1.0, middle + half)


def rate(name: str, hits: Iterable[bool]) -> str:
    """One line of text, for other studies."""
    return f"{name}: {Rate.of(name, hits).words}"


def sections(scores: Sequence[Score]) -> list[Section]:
    """The whole report of a study."""
    of = {kind: [s for s in scores if s.kind == kind] for kind in ("single", "pair", "outside", "smooth", "rough")}
    still = [s for s in scores if s.kind == "still"]
    found = [_summary(of, still)]
    if any(s.rivals for s in scores):
        found.append(_rivals(of))
    for title, (key, order) in GROUPS.items():
        found.append(_by(f"Single effects by {title}", of["single"], key, order))
    told = [s for s in of["pair"] if s.lesser]
    found += [_by("Pairs by severity", of["pair"], lambda s: s.severity, tuple(SEVERITIES)),
              _by("Pairs by severity of the lesser effect beside the other", told, lambda s: s.lesser,
                  tuple(SEVERITIES)),
              _by("Outside the catalogue by severity", of["outside"], lambda s: s.severity, tuple(SEVERITIES)),
              _by("Outside the catalogue", of["outside"], lambda s: s.truth[0], ()),
              _parameters(scores), _times(scores), _failures(scores)]  # fmt: skip
    return [section for section in found if section.rows or section.lines]


def _summary(of: dict[str, list[Score]], still: list[Score]) -> Section:
    single, pairs, outside = of["single"], of["pair"], of["outside"]
    nothing = [*of["smooth"], *of["rough"]]
    visible = [s for s in single if s.severity in CLEAR]
    rates = [
        Rate.of("single effects: right name or accepted set", (s.good for s in single)),
        Rate.of("- strong and clear", (s.good for s in visible)),
        Rate.of("- faint", (s.good for s in single if s.severity == "faint")),
        Rate.of("- right name, first", (s.outcome == "right" for s in single)),
        Rate.of("- false name (wrong, or beside the true one)", (s.false_name for s in single)),
        Rate.of("- abstained (no_mismatch)", (s.outcome == "abstained" for s in single)),
        Rate.of("- unexplained", (s.outcome == "unexplained" for s in single)),
        Rate.of("- insufficient_data or failed", (s.outcome in ("insufficient", "failed") for s in single)),
        Rate.of("pairs: both, or accepted set", (s.good for s in pairs)),
        Rate.of("- at least one", (bool(s.at_least_one) for s in pairs)),
        Rate.of("- both, where each is clear beside the other", (s.good for s in pairs if s.lesser in CLEAR)),
        Rate.of("- false name", (s.false_name for s in pairs)),
        Rate.of("nothing hidden: false name", (s.false_name for s in nothing)),
        Rate.of("- smooth friction", (s.false_name for s in of["smooth"])),
        Rate.of("- rough friction", (s.false_name for s in of["rough"])),
        Rate.of("- verdict no_mismatch", (s.good for s in nothing)),
        Rate.of("outside the catalogue: unexplained", (s.good for s in outside)),
        Rate.of("- where it is strong or clear", (s.good for s in outside if s.severity in CLEAR)),
        Rate.of("- false name", (s.false_name for s in outside)),
        Rate.of("- coordinate right (or among its alternatives)", (bool(s.located) for s in outside)),
        Rate.of("- coordinate right, first", (bool(s.located_first) for s in outside)),
        Rate.of("- interval right, where there is one", (s.interval for s in outside if s.interval is not None)),
        Rate.of("hardly moves: insufficient_data", (s.good for s in still)),
    ]
    return Section("Summary", rows=tuple((one.name, (one,)) for one in rates))


def _rivals(of: dict[str, list[Score]]) -> Section:
    """Ours and the rivals on the cases that all of them had."""
    had = {kind: [s for s in scores if s.rivals] for kind, scores in of.items()}
    methods = list(next(s for scores in had.values() for s in scores).rivals)
    nothing = [*had["smooth"], *had["rough"]]

    def row(
        name: str, scores: list[Score], ours: Callable[[Score], object], theirs: str
    ) -> tuple[str, tuple[Rate, ...]]:
        own = Rate.of(name, (bool(ours(s)) for s in scores))
        return name, (own, *(Rate.of(name, (bool(s.rivals[m][theirs]) for s in scores)) for m in methods))

    rows = (
        row("single: right or accepted set", had["single"], lambda s: s.good, "good"),
        row("single: first name true", had["single"], lambda s: s.outcome in ("right", "extra", "accepted"), "first"),
        row("single: false name", had["single"], lambda s: s.false_name, "false_name"),
        row("pairs: both or accepted set", had["pair"], lambda s: s.good, "good"),
        row("pairs: at least one", had["pair"], lambda s: s.at_least_one, "at_least_one"),
        row("pairs: false name", had["pair"], lambda s: s.false_name, "false_name"),
        row("nothing hidden: a name", nothing, lambda s: s.false_name, "false_name"),
        row("outside: a name", had["outside"], lambda s: s.false_name, "false_name"),
    )
    return Section("The same cases through what everybody would try", (OURS, *methods), rows)


GROUPS: dict[str, tuple[Callable[[Score], str], tuple[str, ...]]] = {
    "severity": (lambda s: s.severity, tuple(SEVERITIES)),
    "drawn size": (lambda s: s.size, tuple(SIZES)),
    "loop": (lambda s: s.loop, ()),
    "excitation": (lambda s: s.excitation, ()),
    "noise [m]": (lambda s: f"{s.noise:g}", ()),
    "period [s]": (lambda s: f"{s.period:g}", ()),
    "orientation": (lambda s: s.orientation, ()),
    "curves": (lambda s: s.shapes, ()),
    "effect": (lambda s: s.truth[0], ()),
}


def _by(title: str, scores: Sequence[Score], key: Callable[[Score], str], order: Sequence[str]) -> Section:
    groups = [name for name in order or sorted({key(s) for s in scores}) if any(key(s) == name for s in scores)]
    rows = []
    for name in groups:
        own = [s for s in scores if key(s) == name]
        rows.append((name, (
            Rate.of(name, (s.good for s in own)),
            Rate.of(name, (s.false_name for s in own)),
            Rate.of(name, (s.outcome in ("abstained", "no_mismatch") for s in own)),
            Rate.of(name, (s.verdict == "unexplained" for s in own)),
        )))  # fmt: skip
    return Section(title, ("as wanted", "false name", "abstained", "unexplained"), tuple(rows))


def _parameters(scores: Sequence[Score]) -> Section:
    lines = []
    held = Rate.of("95 % interval of a parameter holds the truth", (hit for s in scores for _, hit in s.covered))
    for what, values, shown in (
        ("relative error of parameters", [e for s in scores for _, e in s.errors], "{:.1%}"),
        ("error of places over the travel", [e for s in scores for _, e in s.places], "{:.2%}"),
        ("held-out criterion, extended over baseline", [1 / s.ratio for s in scores if s.ratio and s.good], "{:.2f}"),
        ("held-out criterion, extended over the true machine's",
         [s.over_true for s in scores if s.over_true is not None], "{:.2f}"),
        ("share of the true machine's gain (logarithm)",
         [s.gained for s in scores if s.gained is not None], "{:.2f}"),
    ):  # fmt: skip
        if values:
            middle, high = (shown.format(value) for value in np.quantile(values, [0.5, 0.9]))
            lines.append(f"- {what}: median {middle}, nine in ten below {high} ({len(values)})")
    worst = Counter(name for s in scores for name, hit in s.covered if not hit)
    total = Counter(name for s in scores for name, _ in s.covered)
    lines += [f"- misses most: {', '.join(f'{n} {k} of {total[n]}' for n, k in worst.most_common(6))}"] if worst else []
    return Section("Effects named right", rows=((held.name, (held,)),), lines=tuple(lines))


def _times(scores: Sequence[Score]) -> Section:
    if not scores:
        return Section("Time")
    wall, cpu = ([getattr(s, what) for s in scores] for what in ("seconds", "cpu"))
    line = (f"Per case: median {np.median(wall):.1f} s, longest {max(wall):.1f} s; CPU, start of the program included: "
            f"median {np.median(cpu):.1f} s, longest {max(cpu):.1f} s.")  # fmt: skip
    return Section("Time", lines=(line,))


def _failures(scores: Sequence[Score]) -> Section:
    """Every case that is not good, with what was true."""
    lines = ["Outcomes: " + ", ".join(f"{k} {n}" for k, n in Counter(s.outcome for s in scores).most_common()), ""]
    for s in sorted((s for s in scores if not s.good), key=lambda s: (s.outcome not in EXTRA, s.kind, s.case)):
        place = f", at {s.coordinate}" if s.coordinate else ""
        lines.append(
            f"- {s.case} {s.kind} {s.outcome}: true {'+'.join(s.truth) or 'nothing'}; said "
            f"{'+'.join(s.said) or s.verdict}{place} ({s.severity}, {s.size}, {s.excitation}, {s.noise:g} m, "
            f"{s.period:g} s, {s.orientation}, {s.shapes})"
        )
    return Section("Every case that is not as wanted", lines=tuple(lines))
