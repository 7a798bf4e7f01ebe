"""Commissioning and today: does the diagnosis see what changed, and nothing where nothing did? `make before-after`.

Pairs of recordings of one machine by the independent simulator: the second with an effect that the first lacks, with
other friction, or unchanged. Training seeds.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from identify.mismatch.diagnosis import diagnose
from identify.mismatch.result import Diagnosis
from tests.blind.tables import rate
from tests.identify.studies.reading import recorded
from tests.reference.cases import Case, CaseSpec, UndrawableError, draw_case

EFFECTS = ("rail_defect", "viscous_asymmetry", "torque_ripple", "position_spring", "load_dependent_friction",
           "actuator_lag", "quadratic_drag", "position_dependent_friction")  # fmt: skip
EXCITATIONS = ("sine", "multisine", "loop_scurve", "loop_cycle", "loop_sine", "two_squares")


def pairs(count: int, seed: int) -> Iterator[tuple[str, Case]]:
    """Every third pair unchanged, one with a new effect, one with 8-30 % more dry friction; the label and the case."""
    for number in range(count):
        rng = np.random.default_rng([79, seed, number])
        what = ("nothing", str(rng.choice(EFFECTS)), "coulomb_force")[number % 3]
        effects = (what,) if what in EFFECTS else ()
        wear = float(rng.uniform(1.08, 1.3)) if what == "coulomb_force" else 1.0
        for attempt in range(10):
            spec = CaseSpec(seed + 10 * number + attempt, effects, excitation=str(rng.choice(EXCITATIONS)),
                            duration=20.0, size=float(rng.uniform(0.5, 1.2)), noise=float(rng.choice([1e-5, 1e-4])),
                            recordings=1, before=True, wear=wear)  # fmt: skip
            try:
                case = draw_case(spec)
            except UndrawableError:
                continue
            yield what, case
            break


def diagnosed(case: Case) -> Diagnosis:
    """The diagnosis of a case."""
    axis, recordings = recorded(case)
    return diagnose(recordings, axis)


def main() -> None:
    """Print every pair, then the rates."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=73_000, help="a training seed")
    given = parser.parse_args()
    quiet, named, covered, raised, beside = [], [], [], [], []
    held: list[bool] = []
    beside_wear: list[bool] = []
    for what, case in pairs(given.pairs, given.seed):
        found = diagnosed(case)
        said = [
            (one.effect, one.parameter, round(one.before, 3), round(one.after, 3), one.kind) for one in found.changes
        ]
        print(f"{what:<28}{case.spec.excitation:<13}{found.verdict.value}: "
              f"{'+'.join(e.name for e in found.effects) or '-'}; {said}", flush=True)  # fmt: skip
        friction = {one.parameter for one in found.changes if one.effect is None}
        if what == "nothing":
            quiet.append(bool(found.changes))
        elif what == "coulomb_force":
            raised.append(bool(friction & {"coulomb_force", "static_force"}))
            beside_wear.append(bool(friction - {"coulomb_force", "static_force"}))
            grown = 1.0 - 1.0 / case.spec.wear
            held += [one.ci95[0] <= grown * case.labels["friction"][one.parameter] <= one.ci95[1]
                     for one in found.changes if one.parameter in ("coulomb_force", "static_force")]  # fmt: skip
        else:
            right = what in {effect.name for effect in found.effects}
            named.append(right)
            if right:
                covered.append(any(one.effect == what and one.kind in ("appeared", "grown") for one in found.changes))
                beside.append(bool(friction))
    print(rate("unchanged: anything called changed", quiet))
    print(rate("new effect: named in today's data", named))
    print(rate("  of those: said to have appeared or grown", covered))
    print(rate("  of those: friction called changed beside it", beside))
    print(rate("more dry friction: seen", raised))
    print(rate("  something else called changed beside it", beside_wear))
    print(rate("  95 % interval of the difference holds the truth", held))


if __name__ == "__main__":
    main()
