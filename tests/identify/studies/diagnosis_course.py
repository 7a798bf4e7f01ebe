"""Where the time of a diagnosis goes, and how far off its progress bar is. `make diagnosis-course`.

Machines of training seeds; CPU time, so that a busy computer changes nothing. Prints the medians that
`monitor/cli/course.py` holds as constants, and the foreseen time left over the true one.
"""

import argparse
import time
from collections import defaultdict

import numpy as np

from identify.mismatch.diagnosis import diagnose
from monitor.cli.course import Course
from tests.identify.studies.reading import recorded
from tests.reference.cases import CaseSpec, UndrawableError, draw_case

HIDDEN = ((), ("rail_defect",), ("viscous_asymmetry",), ("dead_time",), ("rail_defect", "force_offset"), ("backlash",))
MOTIONS = ("sine", "multisine", "loop_scurve")


def heard(seed: int, number: int):
    """Steps of one diagnosis with the CPU time at which each began, and that of the end. [s]"""
    spec = CaseSpec(seed=seed, effects=HIDDEN[number % len(HIDDEN)], excitation=MOTIONS[number % len(MOTIONS)])
    axis, recordings = recorded(draw_case(spec))
    steps, begin = [], time.process_time()
    found = diagnose(recordings, axis, progress=lambda doing: steps.append((time.process_time() - begin, doing)))
    return found.verdict, steps, time.process_time() - begin


def main() -> None:
    """Diagnose, and print where the time went."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--first", type=int, default=4200)
    options.add_argument("--cases", type=int, default=16)
    asked = options.parse_args()
    heard(asked.first, 1)  # kernels are loaded
    spent, ratios = defaultdict(list), defaultdict(list)
    for number in range(asked.cases):
        try:
            verdict, steps, end = heard(asked.first + number, number)
        except UndrawableError:
            continue
        tell(verdict, steps, end, spent, ratios)
    for what, seconds in spent.items():
        print(f"{what:30} {np.median(seconds):6.2f} (of {len(seconds)})")
    for part, found in sorted(ratios.items()):
        low, middle, high = np.quantile(found, [0.1, 0.5, 0.9])
        print(f"after {part:4} of the time: foreseen / true {middle:.2f} [{low:.2f}, {high:.2f}] of {len(found)}")


def tell(verdict, steps, end, spent, ratios):
    """Note one diagnosis: time of each kind of step in fits of its first search, and how good each forecast was."""
    begins = [at for at, _ in steps] + [end]
    fits = [b - a for (a, one), b in zip(steps, begins[1:], strict=True) if one.stage == "search"][:6]
    fit = float(np.median(fits)) if fits else float("nan")
    course = Course()
    for (at, one), after in zip(steps, begins[1:], strict=True):
        name = one.what if one.stage in ("baseline", "conclusion") else f"{one.stage} fit"
        spent["share" if name.startswith("share") else name].append((after - at) / fit)
        course.hear(one)
        left = course.left(at, 0.0)
        if left is not None and end > at:
            ratios[f"{10 * int(10 * at / end)} %"].append(left / (end - at))
    searches = sum(one.stage == "search" and one.done == 0 for _, one in steps)
    spent["fits in a search"] += [one.of for _, one in steps if one.stage == "search" and one.done == 0]
    for (at, one), after in zip(steps, begins[1:], strict=True):
        print(f"    {at:6.2f} {after - at:6.2f} s {one.stage:10} {one.what} {one.done + 1}/{one.of}")
    print(f"{verdict:14} {end:6.1f} s, {searches} searches, {len(steps)} steps, a fit {fit:.2f} s", flush=True)


if __name__ == "__main__":
    main()
