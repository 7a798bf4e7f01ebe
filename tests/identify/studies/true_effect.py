"""Our fit of the true effect against one that starts from the truth; do its intervals hold? `make true-effect`.

Single effects of the blind study's own plan, one case a seed. The true name is given, so that only the fit is judged:
does the search from our own starts end as likely as the one that begins at the true numbers, how does either predict
data it has not seen next to the true machine, and how many intervals hold the truth (of the catalogue's own curves).
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import pickle
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from identify.mismatch.baseline import read_torque
from identify.mismatch.compare import Fit, fit
from identify.mismatch.data import Evidence, gather
from identify.mismatch.explore import explore
from identify.mismatch.finish import finished
from identify.mismatch.guise import Guise, Setting
from identify.mismatch.report_values import measured as known
from identify.mismatch.report_values import quantities, second_opinion
from identify.mismatch.residual import setting_of
from identify.mismatch.score import extend
from identify.mismatch.ways import guises
from plant.axis import TorqueHold
from plant.effects import find, names
from tests.blind.plan import draw_spec
from tests.blind.sealing import Study, draw
from tests.identify.studies.reading import recorded

FRICTION = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")
SAME = 2.0  # of the loss: fits closer than this have come to the same place


def drawn(seed: int, store: Path, kind: str) -> dict[str, Any] | None:
    """Label and case of `seed`, kept in `store`; None where it is of another kind or has a commissioning state."""
    its_kind, spec = draw_spec(seed, 0)
    if its_kind != kind or spec.before:
        return None
    path = store / f"{seed}.pkl"
    if not path.exists():
        label, case = draw(Study(seed, 1, store), 0)
        path.write_bytes(pickle.dumps((label, case)))
    label, case = pickle.loads(path.read_bytes())
    return None if case is None else {"label": label, "case": case}


def true_starts(guise: Guise, values: dict[str, float], setting: Setting) -> np.ndarray | None:
    """Starting points of `guise` at the true numbers, None where it is not the way in which the effect is present."""
    if guise.wave is not None:
        if not values.get(guise.wave[0]):
            return None
        size = values[guise.wave[0]]
        period = values.get("period") or 2.0 * np.pi * setting.axis.mechanics.Rc
        phase = values.get("phase", 0.0)
        return np.array([[period, size * np.cos(phase), -size * np.sin(phase)]])
    if dict(guise.fixed).get("weight_share", 0.0) != (values.get("payload", 0.0) if guise.fixed else 0.0):
        return None
    usual = {parameter.name: parameter.default for parameter in guise.effect.parameters if not parameter.reported}
    known = usual | values  # nobody knows how a contact gives
    row = [known[unknown.parameter] for unknown in guise.unknowns]
    inside = all(u.low <= v <= u.high for u, v in zip(guise.unknowns, row, strict=True))
    return np.array([row]) if inside else None


def oracle(baseline: Fit, ways: list[Guise], truth: dict[str, dict[str, float]], friction: dict[str, float],
           setting: Setting) -> Fit | None:  # fmt: skip
    """The fit that starts from the true numbers."""
    current = baseline
    for name, values in truth.items():
        offered = [(way, true_starts(way, values, setting)) for way in ways if way.name == name]
        offered = [(way, rows) for way, rows in offered if rows is not None]
        if not offered:
            return None
        way, rows = offered[0]
        problem, x = extend(current, way, dataclasses.replace(way, starts=rows).scaled_starts())
        x[:, :4] = problem.encode(friction)[:4]
        current = Fit(problem, dataclasses.replace(current.found, x=x[0]))
    return fit(current.problem, np.stack([current.x]))


def held_out(fitted: Fit, evidence: Evidence) -> float:
    """Eq. (4) over one-second runs on unseen data."""
    problem = fitted.problem.on(evidence.held_out)
    x = np.concatenate([fitted.x[: problem.p], np.zeros(2 * evidence.held_out.runs)])
    return Fit(problem, dataclasses.replace(fitted.found, x=x)).short_run()


def covered(fitted: Fit, evidence: Evidence, truth: dict[str, dict[str, float]]) -> dict[str, list[float]]:
    """Parameter -> value, truth, half-width on the side of the truth, and that without a second opinion."""
    one, other = known(fitted), second_opinion(fitted, evidence.held_out)
    found = {}
    for guise in fitted.problem.guises:
        for name, shown in quantities(one, guise, other).items():
            true = truth.get(guise.name, {}).get(name)
            alone = quantities(one, guise)[name]
            if true is not None and shown.ci95 is not None and alone.ci95 is not None:
                side = int(true > shown.value)
                found[f"{guise.name}.{name}"] = [
                    shown.value, true, abs(shown.ci95[side] - shown.value), abs(alone.ci95[side] - shown.value)
                ]  # fmt: skip
    return found


def measured(seed: int, store: Path, kind: str = "single") -> dict[str, Any] | None:
    """One case's figures."""
    found = drawn(seed, store, kind)
    if found is None:
        return None
    label, case = found["label"], found["case"]
    axis, recordings = recorded(case)
    doubtful = all(r.loop == "closed" and r.hold in (TorqueHold.HOLD, TorqueHold.UNKNOWN) for r in recordings)
    clock = time.process_time()
    evidence, baseline = read_torque(gather(recordings, axis), axis, doubtful, 0)
    native = max(float(np.median(np.diff(recording.t))) for recording in recordings)
    setting = setting_of(baseline.problem, baseline.x, native)
    ways = guises({name: find(name) for name in names()}, setting)
    base = time.process_time() - clock
    truth = {name: dict(values) for name, values in case.plant.effects.items()}
    spec = label["spec"]
    row: dict[str, Any] = {
        "seed": seed, "effects": list(truth), "shapes": label["shapes"], "excitation": spec["excitation"],
        "noise": spec["noise"], "period": spec["period"], "size": spec["size"], "orientation": spec["orientation"],
        "true": label["true_criterion"], "baseline": baseline.found.criterion,
        "baseline_held": held_out(baseline, evidence),
    }  # fmt: skip
    clock = time.process_time()
    ours = baseline
    tried = []
    for _ in truth:
        taken = {guise.name for guise in ours.problem.guises}
        _, steps = explore(
            ours, [way for way in ways if way.name in truth and way.name not in taken], evidence.held_out
        )
        if not steps:
            break
        tried.append([steps[0].guise.name, steps[0].refused])
        ours = steps[0].fit
    row["cpu"] = [base, time.process_time() - clock]
    row["tried"] = tried
    row["named"] = len(ours.problem.guises) == len(truth)
    if row["named"]:
        clock = time.process_time()
        final = finished(ours, evidence.held_out, setting.native_time or setting.sample_time)
        row["cpu"].append(time.process_time() - clock)
        row["covered"], row["final_held"] = covered(final, evidence, truth), held_out(final, evidence)
        row["final_setting"] = list(final.found.setting)
        row["ours"], row["ours_held"], row["setting"] = (
            ours.found.criterion, held_out(ours, evidence), list(ours.found.setting))  # fmt: skip
    best = oracle(baseline, ways, truth, label["friction"], setting)
    if best is not None:
        row["oracle"], row["oracle_held"] = best.found.criterion, held_out(best, evidence)
        row["oracle_setting"] = list(best.found.setting)
    return row


def main() -> None:
    """Print a line of JSON per case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=8200)
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--kind", default="single")
    parser.add_argument("--store", type=Path, default=Path(".cache/cases"))
    parser.add_argument("--draw", action="store_true", help="only draw the cases")
    arguments = parser.parse_args()
    arguments.store.mkdir(parents=True, exist_ok=True)
    for seed in range(arguments.first, arguments.first + arguments.count, arguments.every):
        if arguments.draw:
            drawn(seed, arguments.store, arguments.kind)
            continue
        row = measured(seed, arguments.store, arguments.kind)
        if row is not None:
            sys.stdout.write(json.dumps(row) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
