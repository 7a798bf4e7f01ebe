"""How well names are found on training cases of the blind study, and why each miss is one.

`make naming` draws the cases of the blind study's own plan, diagnoses them in process, fits the *true* effects from the
true values (the oracle), and keeps for each case, in `var/naming`, the answer and what every step of the search saw.
Seeds that judge (`tests.blind.plan`) are refused.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import pickle
import time
from pathlib import Path

import numpy as np

from identify.mismatch.compare import compare, fit
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.diagnosis import conclude
from identify.mismatch.inverse import effect_force
from identify.mismatch.result import Diagnosis
from identify.mismatch.rules import price, refusal
from identify.mismatch.written import written
from tests.blind.plan import JUDGE_SEED, draw_spec
from tests.blind.scoring import Score, score
from tests.blind.sealing import Study, draw
from tests.identify.studies.reading import recorded


def drawn(seed: int, index: int, folder: Path) -> tuple:
    """Label, true machine, axis and recordings of a case, kept in `folder`."""
    kept = folder / f"case-{seed}-{index}.pickle"
    if kept.exists():
        return pickle.loads(kept.read_bytes())
    label, case = draw(Study(seed, index + 1, folder), index)
    found = (label, None, None, None) if case is None else (label, case.plant, *recorded(case))
    kept.write_bytes(pickle.dumps(found))
    return found


def oracle(conclusion: Conclusion, plant) -> dict | None:
    """The true effects, started from their true values: what our own model of them gains over the baseline."""
    baseline = conclusion.selection.baseline
    chosen = []
    for name, given in plant.effects.items():
        offered = [way for way in conclusion.ways if way.name == name and _fits(way, given)]
        if not offered:
            return {"none": name}
        chosen.append((offered[0], given))
    problem = baseline.problem.including(tuple(way for way, _ in chosen))
    start = np.concatenate([baseline.x[: problem.base], np.zeros(problem.size - problem.base)])
    start[problem.p :] = baseline.x[baseline.problem.p :]
    for way, given in chosen:
        start[problem.slot(way)] = _scaled(way, given)
    s, true = problem.scales, start.copy()
    true[:4] = (plant.coulomb_force / s.force, plant.static_force / s.force,
                np.log(plant.stribeck_velocity / s.speed), plant.viscous_coefficient * s.speed / s.force)  # fmt: skip
    low, high = problem.bounds
    best = fit(problem, np.clip(np.stack([true, start]), low, high))
    evidence = compare(baseline, best, conclusion.evidence.held_out)
    refused = [refusal(best, way, evidence, effect_force(problem, best.x, way)[1]) for way, _ in chosen]
    return {"price": price(best), **dataclasses.asdict(evidence), "refused": refused}


def _fits(way, given) -> bool:
    """Whether a guise is the one of the true parameters: which end of the travel, which kind of ripple."""
    if "side" in given:
        towards = float(given["side"])
        return bool((way.unknowns[0].origin - 0.5 * (way.unknowns[0].low + way.unknowns[0].high)) * towards > 0)
    return not any(given.get(name, 0.0) and not value for name, value in way.fixed if name != "weight_share") and not (
        way.name == "inertia_error" and ("weight_share", given.get("payload", 0.0)) not in way.fixed and way.fixed
    )


def _scaled(way, given) -> np.ndarray:
    defaults = {p.name: p.default for p in way.effect.parameters if isinstance(p.default, float)}
    values = defaults | dict(given)
    if way.wave is not None:
        size, phase = values[way.wave[0]], values.get("phase", 0.0)
        values[way.wave[0]], values["phase"] = size * np.cos(phase), -size * np.sin(phase)
        values.setdefault("period", way.turn)
    return np.array([u.scaled(max(values[u.parameter], 1e-9) if u.log else values[u.parameter]) for u in way.unknowns])


def seen(step, current) -> dict:
    """What a rule may look at, as plain numbers."""
    known = step.guise in step.fit.problem.guises
    slot = step.fit.problem.slot(step.guise) if known else None
    values = {} if slot is None else dict(zip(
        [p.name for p in step.guise.effect.parameters], step.guise.values(step.fit.x[slot][None])[:, 0].tolist(),
        strict=False))  # fmt: skip
    return {
        "name": step.guise.name, "fixed": list(step.guise.fixed), "refused": step.refused, "price": price(step.fit),
        **dataclasses.asdict(step.evidence), "force": step.force_rms, "acting": step.acting,
        "dry": step.fit.dry_level, "latent": step.fit.latent_force, "values": values, "p": step.fit.problem.p,
        "current": current,
    }  # fmt: skip


def case_of(seed: int, index: int, folder: Path) -> dict | None:
    """Everything about one case; kept in `folder`."""
    label, plant, axis, recordings = drawn(seed, index, folder)
    if axis is None:
        return None
    begun = time.process_time()
    conclusion = conclude(recordings, axis)
    answer = (conclusion if isinstance(conclusion, Diagnosis) else written(conclusion)).to_dict()
    spent = time.process_time() - begun
    found = {"index": index, "seed": seed, "label": label, "answer": answer, "cpu": spent}
    if isinstance(conclusion, Diagnosis):
        return found
    chosen = conclusion.selection
    found["stages"] = [[seen(step, k) for step in steps] for k, steps in enumerate(chosen.rivals)]
    found["named"] = [seen(step, -1) for step in chosen.steps]
    found["baseline"] = {"price": price(chosen.baseline), "latent": chosen.baseline.latent_force,
                         "dry": chosen.baseline.dry_level}  # fmt: skip
    found["chosen"] = {"price": price(chosen.chosen), "latent": chosen.chosen.latent_force}
    found["torn"] = {"plain": conclusion.held_out(conclusion.plain) / conclusion.own,
                     "final": conclusion.held_out(conclusion.final) / conclusion.own,
                     "kind": conclusion.evidence.kind}  # fmt: skip
    found["nameless"] = [dataclasses.asdict(one) for one in conclusion.nameless]
    if plant.effects and label["kind"] != "still":
        found["oracle"] = oracle(conclusion, plant)
    return found


def scored(found: dict) -> Score:
    """The blind study's own score."""
    return score(str(found["index"]), found["label"], {"answer": found["answer"], "seconds": 0.0, "cpu": found["cpu"]})


def line(found: dict) -> str:
    """One case in a line."""
    one, spec = scored(found), found["label"]["spec"]
    truth = ",".join(one.truth) or "-"
    told = found.get("oracle") or {}
    knew = f" oracle {-told['bic']:.0f} z {told['z']:.1f} u {told['unseen']:.2f}" if "bic" in told else f" {told or ''}"
    refused = [r for r in told.get("refused", []) if r]
    sets = len(found["answer"]["alternatives"])
    place = (found["answer"]["location"] or {}).get("coordinate", "")
    best = "; ".join(
        f"{s['name']} {-s['bic']:.0f}/{s['z']:.1f}{'' if s['refused'] is None else ' x ' + s['refused'][:34]}"
        for s in (found.get("stages") or [[]])[0][:4]
    )
    return (
        f"{found['seed']}-{found['index']} {one.kind} {one.outcome.upper() if one.false_name else one.outcome}"
        f" [{one.severity}] {truth} -> {','.join(one.said) or one.verdict} {place} sets {sets};{knew} {refused or ''}"
        f" | {spec['excitation']} {spec['noise']:g} {spec['orientation'][:4]} {spec['size']:.2f} {spec['shapes'][:4]}"
        f" {spec['period']:g} {found['cpu']:.1f}s\n      {best}"
    )


def main() -> None:
    """Read the arguments and run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=8100, help="a training seed")
    parser.add_argument("--cases", default="0:60", help="from:to, or numbers with commas")
    parser.add_argument("--out", type=Path, default=Path("var/naming"))
    parser.add_argument("--kinds", default="", help="only these kinds, with commas")
    parser.add_argument("--redo", action="store_true", help="diagnose again what was diagnosed")
    given = parser.parse_args()
    if given.seed >= JUDGE_SEED:
        parser.error(f"seeds from {JUDGE_SEED} on judge: never here")
    given.out.mkdir(parents=True, exist_ok=True)
    numbers = range(*map(int, given.cases.split(":"))) if ":" in given.cases else map(int, given.cases.split(","))
    for index in numbers:
        if given.kinds and draw_spec(given.seed, index)[0] not in given.kinds.split(","):
            continue
        kept = given.out / f"found-{given.seed}-{index}.json"
        if given.redo or not kept.exists():
            found = case_of(given.seed, index, given.out)
            if found is None:
                continue
            kept.write_text(json.dumps(found, default=float))
            print(line(json.loads(kept.read_text())), flush=True)


if __name__ == "__main__":
    main()
