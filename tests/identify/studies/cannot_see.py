"""What a recording can show and what it cannot, by excitation; writes docs/what-it-cannot-see.md. `make cannot-see`.

Healthy machines of the independent simulator are recorded under every excitation. For each recording the tool says how
large an effect must be to be named (`detectable`); and from the responses of its predictor to each effect, past what
the baseline can swallow, how alike two effects look. Medians over the machines.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter, defaultdict

import numpy as np

from identify.mismatch.baseline import fit_baseline
from identify.mismatch.data import gather
from identify.mismatch.detect import detectable
from identify.mismatch.residual import setting_of
from identify.mismatch.score import leads
from identify.mismatch.ways import guises
from identify.mismatch.words import LIMITS
from plant.effects import find, names
from tests.blind.frozen import digest, engine
from tests.identify.studies.reading import recorded
from tests.identify.studies.real_machines import ROOT
from tests.reference.cases import CaseSpec, UndrawableError, draw_case

PAGE = ROOT / "docs" / "what-it-cannot-see.md"
EXCITATIONS = ("sine", "multisine", "two_squares", "loop_sine", "loop_trapezoid", "loop_cycle")
ALIKE = 0.95  # cosine from which a pair stands in the table
Seen = dict[str, tuple[float, str, float]]


def looked_at(spec: CaseSpec) -> tuple[Seen, dict[tuple[str, str], float]]:
    """Smallest sizes, units and forces over F_c by effect; cosines by pair."""
    case = draw_case(spec)
    axis, recordings = recorded(case)
    fitted = fit_baseline(gather(recordings, axis).train, axis, 0)
    ways = guises({name: find(name) for name in names()}, setting_of(fitted.problem, fitted.x))
    level = case.plant.coulomb_force
    sizes = {name: (one.value, one.unit, one.force_rms / level) for name, one in detectable(fitted, ways).items()}
    response = {lead.guise.name: lead.response for lead in leads(fitted, ways, fitted.found.gain)[::-1]}
    alike = {(a, b): abs(float(response[a] @ response[b])) for a in sorted(response) for b in sorted(response) if a < b}
    return sizes, alike


def measured(machines: int, seed: int) -> tuple[dict[str, list[Seen]], dict[str, list[dict[tuple[str, str], float]]]]:
    """Everything by excitation."""
    sizes: dict[str, list[Seen]] = defaultdict(list)
    alike: dict[str, list[dict[tuple[str, str], float]]] = defaultdict(list)
    for excitation in EXCITATIONS:
        for number in range(3 * machines):
            if len(sizes[excitation]) == machines:
                break
            try:
                one, pairs = looked_at(CaseSpec(seed + number, excitation=excitation, duration=20.0))
            except UndrawableError:
                continue
            sizes[excitation].append(one)
            alike[excitation].append(pairs)
            sys.stderr.write(f"{excitation} {number}\n")
    return sizes, alike


def sizes_table(sizes: dict[str, list[Seen]]) -> list[str]:
    """Smallest size that would have been named, and its force in per cent of the dry friction."""
    units = defaultdict(set)
    for found in sizes.values():
        for one in found:
            for name, (_, unit, _) in one.items():
                units[name].add(unit)
    lines = [f"| effect, unit | {' | '.join(sizes)} |", "|---" * (1 + len(sizes)) + "|"]
    for name in sorted(names()):
        cells = []
        for found in sizes.values():
            own = [one[name] for one in found if name in one]
            if 2 * len(own) <= len(found):
                cells.append("not seen")
                continue
            unit = Counter(entry[1] for entry in own).most_common(1)[0][0]
            own = [entry for entry in own if entry[1] == unit]
            value, force = (float(np.median([entry[k] for entry in own])) for k in (0, 2))
            shown = f"{value:.2g}" + (f" {'of torque' if unit == '1' else unit}" if len(units[name]) > 1 else "")
            cells.append(shown + (f" ({100 * force:.1f} %)" if np.isfinite(force) else ""))
        unit = f" [{next(iter(units[name]))}]" if len(units[name]) == 1 else ""
        lines.append(f"| {name}{unit} | {' | '.join(cells)} |")
    return lines


def pairs_table(alike: dict[str, list[dict[tuple[str, str], float]]]) -> list[str]:
    """Pairs that look alike in some excitation."""
    lines = [f"| pair | {' | '.join(alike)} |", "|---" * (1 + len(alike)) + "|"]
    rows = []
    for pair in sorted({pair for found in alike.values() for one in found for pair in one}):
        medians = [
            float(np.median(own)) if (own := [one[pair] for one in found if pair in one]) else float("nan")
            for found in alike.values()
        ]
        if np.nanmax(medians, initial=0.0) >= ALIKE:
            cells = ["-" if np.isnan(m) else f"**{m:.2f}**" if m >= ALIKE else f"{m:.2f}" for m in medians]
            rows.append((-sum(m >= ALIKE for m in medians), f"| {pair[0]}, {pair[1]} | {' | '.join(cells)} |"))
    return lines + [row for _, row in sorted(rows)]


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--machines", type=int, default=5)
    parser.add_argument("--seed", type=int, default=75_000, help="a training seed")
    given = parser.parse_args()
    sizes, alike = measured(given.machines, given.seed)
    text = [PREFACE.format(engine=engine(), thresholds=digest(), machines=given.machines),
            "## Limits", "", *(f"- {line}" for line in LIMITS), "",
            "## How large an effect must be", "", SIZES, *sizes_table(sizes), "",
            "## Which effects look alike", "", PAIRS, *pairs_table(alike)]  # fmt: skip
    PAGE.write_text("\n".join(text) + "\n", encoding="utf-8")


PREFACE = """\
# What it cannot see

Generated by `make cannot-see` (engine {engine}, thresholds {thresholds}): {machines} healthy vertical machines of the
independent simulator, 20 s at 100 Hz, 0.1 mm of position noise, 0.5 % of the dry friction that does not repeat. Your
own recordings get their own table: `detectable` in the answer of [`tribowatch diagnose`](diagnosis.md).
"""
SIZES = """\
Median smallest size of the effect's first parameter that would have been named nine times of ten, and in brackets the
force it brings, rms, over the dry friction. An amplitude is a size; a stiffness, a limit or the place of a stop says
where it must lie; torque ripple comes in newtons or as a share of the torque. *Not seen*: not at any plausible size on
half of the machines. `sine`, `multisine`, `two_squares` are torques in an open loop, `loop_...` motions in a position
loop.
"""
PAIRS = """\
Cosine between the predictor's responses to two effects, past what the baseline's own parameters can swallow: at 1 they
are one and the same in this motion, whatever the size. Pairs with 0.95 (bold) or more somewhere; a diagnosis says for
its own recordings which names are tied, and simulates what would separate them ([next
experiment](diagnosis.md#the-next-experiment)).
"""


if __name__ == "__main__":
    main()
