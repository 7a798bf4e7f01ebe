"""Tables of a study as text, every rate with its 95 % interval (Wilson)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from tests.blind.scoring import SEVERITIES, SIZES, Score

EXTRA = {"wrong", "extra", "one_and_wrong"}


def wilson(hits: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """95 % interval of a rate; (0, 1) of nothing."""
    if total == 0:
        return 0.0, 1.0
    rate, shrink = hits / total, 1.0 + z * z / total
    middle = (rate + z * z / (2 * total)) / shrink
    half = z * math.sqrt(rate * (1 - rate) / total + z * z / (4 * total * total)) / shrink
    return max(0.0, middle - half), min(1.0, middle + half)


def rate(name: str, hits: Iterable[bool]) -> str:
    """One line: a rate, its interval, and what it is made of."""
    found = [bool(hit) for hit in hits]
    low, high = wilson(sum(found), len(found))
    if not found:
        return f"  {name:<44}      -"
    share = sum(found) / len(found)
    return f"  {name:<44} {share:6.1%}  [{low:4.0%}, {high:4.0%}]  {sum(found)}/{len(found)}"


def report(scores: Sequence[Score], undrawable: int = 0) -> str:
    """The whole report of a study."""
    of = {kind: [s for s in scores if s.kind == kind] for kind in ("single", "pair", "outside", "smooth", "rough")}
    single, pairs, outside, nothing = of["single"], of["pair"], of["outside"], [*of["smooth"], *of["rough"]]
    still = [s for s in scores if s.kind == "still"]
    lines = [f"{len(scores)} cases scored, {undrawable} could not be drawn; rates with 95 % Wilson intervals", ""]
    lines += ["single effects", rate("right name", (s.outcome == "right" for s in single)),
              rate("right name or accepted set", (s.good for s in single)),
              rate("false name (wrong, or beside the true one)", (s.false_name for s in single)),
              rate("abstained (no_mismatch)", (s.outcome == "abstained" for s in single)),
              rate("unexplained", (s.outcome == "unexplained" for s in single)),
              rate("insufficient_data or failed", (s.outcome in ("insufficient", "failed") for s in single)),
    ]  # fmt: skip
    lines += _by("right or accepted by drawn size", single, lambda s: s.size, list(SIZES))
    lines += _by("right or accepted by severity (see scoring.py)", single, lambda s: s.severity, list(SEVERITIES))
    for title, key in GROUPS.items():
        lines += _by(f"right or accepted by {title}", single, key)
    lines += ["", "pairs", rate("both or accepted set", (s.good for s in pairs)),
              rate("at least one", (bool(s.at_least_one) for s in pairs)),
              rate("false name", (s.false_name for s in pairs))]  # fmt: skip
    lines += ["", "nothing hidden", rate("false name, smooth", (s.false_name for s in of["smooth"])),
              rate("false name, rough", (s.false_name for s in of["rough"])),
              rate("verdict no_mismatch", (s.good for s in nothing))]  # fmt: skip
    lines += ["", "outside the catalogue", rate("unexplained", (s.good for s in outside)),
              rate("false name", (s.false_name for s in outside)),
              rate("coordinate right (or among its alternatives)", (bool(s.located) for s in outside)),
              rate("coordinate right, first", (bool(s.located_first) for s in outside)),
              rate("interval right, where there is one", (s.interval for s in outside if s.interval is not None)),
    ]  # fmt: skip
    lines += ["", "hardly moves", rate("insufficient_data", (s.good for s in still))]
    return "\n".join([*lines, *_parameters(scores), *_times(scores), *_failures(scores)]) + "\n"


GROUPS: dict[str, Callable[[Score], str]] = {
    "loop": lambda s: s.loop,
    "excitation": lambda s: s.excitation,
    "noise [m]": lambda s: f"{s.noise:g}",
    "period [s]": lambda s: f"{s.period:g}",
    "orientation": lambda s: s.orientation,
    "curves": lambda s: s.shapes,
    "effect": lambda s: s.truth[0],
}


def _by(title: str, scores: Sequence[Score], key: Callable[[Score], str], order: Sequence[str] = ()) -> list[str]:
    groups = [name for name in order or sorted({key(s) for s in scores}) if any(key(s) == name for s in scores)]
    return ["", title, *(rate(name, (s.good for s in scores if key(s) == name)) for name in groups)]


def _parameters(scores: Sequence[Score]) -> list[str]:
    errors = [error for s in scores for _, error in s.errors]
    lines = ["", "parameters of effects named right"]
    lines.append(rate("95 % interval covers", (hit for s in scores for _, hit in s.covered)))
    if errors:
        middle, high = np.quantile(errors, [0.5, 0.9])
        lines.append(f"  relative error: median {middle:.1%}, nine in ten below {high:.1%}  ({len(errors)} parameters)")
    ratios = [1 / s.ratio for s in scores if s.ratio is not None and s.good]
    if ratios:
        lines.append(f"  held-out criterion, extended over baseline: median {np.median(ratios):.2f}")
    return lines


def _times(scores: Sequence[Score]) -> list[str]:
    if not scores:
        return []
    wall, cpu = ([getattr(s, what) for s in scores] for what in ("seconds", "cpu"))
    return ["", f"time per case: median {np.median(wall):.1f} s, longest {max(wall):.1f} s; "
                f"CPU median {np.median(cpu):.1f} s, longest {max(cpu):.1f} s"]  # fmt: skip


def _failures(scores: Sequence[Score]) -> list[str]:
    """Every case that is not good, with what was true."""
    lines = ["", "outcomes: " + ", ".join(f"{k} {n}" for k, n in Counter(s.outcome for s in scores).most_common())]
    lines += ["", "every case that is not as wanted"]
    for s in sorted((s for s in scores if not s.good), key=lambda s: (s.outcome not in EXTRA, s.kind, s.case)):
        place = f", at {s.coordinate}" if s.coordinate else ""
        lines.append(
            f"  {s.case} {s.kind:<7} {s.outcome:<13} true {'+'.join(s.truth) or 'nothing'}; said "
            f"{'+'.join(s.said) or s.verdict}{place} ({s.size}, {s.excitation}, {s.noise:g} m, {s.period:g} s, "
            f"{s.orientation}, {s.shapes})"
        )
    return lines
