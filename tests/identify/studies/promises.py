"""How often an effect is named that is as large as `detectable` says it would be; prints a table. `make promises`.

A healthy machine of the independent simulator is recorded and diagnosed; then the same machine, motion and noise with
one effect, as large as the healthy recording promises to name nine times of ten. Named is the right name, alone or
among those that cannot be told from it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.result import Diagnosis
from tests.blind.tables import wilson
from tests.identify.studies.reading import recorded
from tests.reference.cases import CaseSpec, UndrawableError, draw_case
from tests.reference.draws import CLOSED_KINDS, OPEN_KINDS

# those whose first parameter goes with the size that is drawn
SIZED = (
    "force_offset", "coulomb_asymmetry", "viscous_asymmetry", "position_dependent_friction", "rail_defect", "backlash",
    "pulley_eccentricity", "load_dependent_friction", "thermal_drift", "quadratic_drag", "position_spring",
    "inertia_error", "torque_scale_error", "actuator_lag", "dead_time", "dwell_time_stiction", "step_change",
)  # fmt: skip
LARGEST = 3.0  # of the size of the simulator's own draws: machines run away beyond


def spec_of(seed: int) -> CaseSpec:
    """A healthy machine and what is recorded of it."""
    rng = np.random.default_rng([77, seed])
    return CaseSpec(
        seed,
        excitation=str(rng.choice([*OPEN_KINDS, *CLOSED_KINDS])),
        noise=float(rng.choice([1e-5, 1e-4, 1e-3])),
        duration=20.0,
        orientation=str(rng.choice(["vertical", "vertical", "horizontal"])),
    )


def answer(spec: CaseSpec) -> Diagnosis:
    """What the tool says of a case.

    Raises:
        UndrawableError: there is no such machine.
    """
    case = draw_case(spec)
    axis, recordings = recorded(case)
    return diagnose(recordings, axis)


def with_effect(spec: CaseSpec, name: str, size: float) -> dict[str, object] | None:
    """What comes of one effect whose first parameter is `size` on the machine of `spec`; None where none is drawn."""
    try:
        large = replace(spec, effects=(name,), size=1.0)
        unit = abs(next(iter(draw_case(large).labels["effects"][name].values())))
        if size > LARGEST * unit:
            return None
        said = answer(replace(large, size=size / unit))
    except UndrawableError:
        return None
    alone = [effect.name for effect in said.effects]
    named = name in alone or any(name in names for names in said.alternatives)
    return {
        "seed": spec.seed, "effect": name, "size": size, "excitation": spec.excitation, "verdict": str(said.verdict),
        "said": alone, "named": named,
    }  # fmt: skip


def kept(seed: int, factor: float = 1.0) -> list[dict[str, object]]:
    """One machine: by effect what was promised and what came of it."""
    spec = spec_of(seed)
    try:
        healthy = answer(spec).detectable
    except UndrawableError:
        return []
    rows = [with_effect(spec, name, factor * healthy[name].value) for name in SIZED if name in healthy]
    return [row for row in rows if row is not None]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=9950)
    parser.add_argument("--machines", type=int, default=12)
    parser.add_argument("--factor", type=float, default=1.0, help="times the promised size")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="all cases go there")
    options = parser.parse_args()
    rows = []
    seeds = range(options.seed, options.seed + options.machines)
    with ProcessPoolExecutor(options.jobs) as pool:
        for seed, found in zip(seeds, pool.map(partial(kept, factor=options.factor), seeds), strict=True):
            rows += found
            sys.stderr.write(f"machine {seed}: {sum(bool(r['named']) for r in found)} of {len(found)}\n")
    if options.json:
        options.json.write_text(json.dumps(rows))
    by = defaultdict(list)
    for row in rows:
        by[str(row["effect"])].append(row)
        by["all"].append(row)
    print("| effect | named at the promised size | nothing said | another name alone |\n|---|---|---|---|")
    for name, some in by.items():
        named = sum(bool(row["named"]) for row in some)
        low, high = wilson(named, len(some))
        nothing = sum(row["verdict"] == "no_mismatch" for row in some)
        wrong = sum(bool(row["said"]) and not row["named"] for row in some)
        print(f"| {name} | {named} of {len(some)} [{low:.0%}, {high:.0%}] | {nothing} | {wrong} |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
