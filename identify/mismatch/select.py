"""Which effects, and how sure: forward, swap, backward; every step decided by several judges at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Comparison, Fit, block_z, compare, fit
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.guise import Guise
from identify.mismatch.inverse import effect_force
from identify.mismatch.score import Lead, extend, leads
from identify.observer import gain_table
from identify.polish import polish_all
from identify.search import CLASSICAL, losses_by_gain

Floats = NDArray[np.float64]

MOST_EFFECTS = 3
AGAIN = 3  # leads looked at again when a chosen effect is put to the test
FAINT = 0.03  # of the best lead's expected gain: fainter ones cannot win
REFITS = 6  # leads that get a full fit per step
BIC = -25.0  # evidence a name needs
Z, Z_STRONG, BIC_STRONG = 3.0, 2.5, -60.0  # agreement of the blocks, and what is enough where the evidence is strong
SMALLEST = 0.007  # of F_c: force of an effect that is worth a name
FREE_RUN = 0.98  # eq. (4) over one second must fall at least to this share
TIED_BIC, TIED_Z, TIED_SHARE = 25.0, 2.5, 0.6  # rivals closer than this cannot be told apart
PROMISING = 15.0  # fall of the loss after a first look below which a candidate is left alone
ROUGH = 0.3  # of log-likelihood units: what an iteration of the first look must gain
TWINS = {
    name: family - {name}
    for family in (
        frozenset({"force_offset", "coulomb_asymmetry", "viscous_asymmetry", "position_spring"}),
        frozenset({"rail_defect", "position_dependent_friction", "torque_ripple", "pulley_eccentricity", "end_stop"}),
        frozenset({"inertia_error", "torque_scale_error", "load_dependent_friction", "quadratic_drag"}),
        frozenset({"actuator_lag", "dead_time", "transmission_compliance"}),
        frozenset({"presliding_hysteresis", "backlash", "dwell_time_stiction"}),
        frozenset({"thermal_drift", "step_change"}),
    )
    for name in family
}
WORTH = 12.0  # expected gain below which a lead is not refitted


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One more effect on top of a fit: the richer fit, what speaks for it, and its force."""

    fit: Fit
    guise: Guise
    evidence: Comparison
    force_rms: float
    refused: str | None


@dataclass(slots=True)
class Selection:
    """The chosen model and what competed with it."""

    baseline: Fit
    chosen: Fit
    steps: list[Step] = field(default_factory=list)
    rivals: list[list[Step]] = field(default_factory=list)


def select(baseline: Fit, guises: list[Guise], progress: Callable[[str], None] = lambda _: None) -> Selection:
    """Add effects one by one while one earns its name, then try to swap and to drop each."""
    selection = Selection(baseline, baseline)
    for _ in range(MOST_EFFECTS):
        current = selection.chosen
        taken = {guise.name for guise in current.problem.guises}
        steps = explore(current, [guise for guise in guises if guise.name not in taken], progress)
        accepted = [step for step in steps if step.refused is None]
        if not accepted:
            selection.rivals.append(steps)
            break
        best = min(accepted, key=lambda step: _price(step.fit))
        selection.steps.append(best)
        selection.rivals.append(steps)
        selection.chosen = best.fit
    if len(selection.steps) > 1:
        _reconsider(selection, guises, progress)
    return selection


def explore(
    current: Fit, guises: list[Guise], progress: Callable[[str], None] = lambda _: None, most: int = REFITS
) -> list[Step]:
    """Refit the most promising of `guises` on top of `current`, judged; best information criterion first."""
    steps = [_refit(current, lead, progress) for lead in shortlist(current, guises, most)]
    return sorted(steps, key=lambda step: _price(step.fit))


def shortlist(current: Fit, guises: list[Guise], most: int = REFITS) -> list[Lead]:
    """Leads worth a full fit, seen at the likeliest gain and at one a decade and a half weaker."""
    gains, settings = gain_table(current.problem.samples.sample_time)
    tau, rho = current.found.setting
    weaker = np.flatnonzero((settings[0] == tau) & (settings[1] <= rho / 30.0))
    weak = gains[:, weaker[-1]] if len(weaker) else gains[:, 0]
    chosen: dict[tuple[str, tuple[tuple[str, float], ...]], Lead] = {}
    for gain in (current.found.gain, weak):
        ranked = [lead for lead in leads(current, guises, gain) if lead.gain > WORTH]
        for lead in ranked[:most]:
            if lead.gain < FAINT * ranked[0].gain:
                break
            chosen.setdefault((lead.guise.name, lead.guise.fixed), lead)
    return list(chosen.values())


def _refit(current: Fit, lead: Lead, progress: Callable[[str], None]) -> Step:
    """Fit `lead` on top of `current` from the distorted baseline and from a textbook one, and judge it."""
    progress(lead.guise.name)
    problem, x = extend(current, lead.guise, lead.start[None])
    classical = x.copy()
    classical[:, :4] = CLASSICAL
    points = x if lead.guise.stiff else np.concatenate([x, classical])
    best, gained = _first_look(current, problem, points)
    if gained < PROMISING:
        bic = (problem.p - current.problem.p) * float(np.log(problem.samples.used)) - gained
        return Step(current, lead.guise, Comparison(bic, 0.0, 1.0), 0.0, f"evidence {-bic:.0f} is below {-BIC:.0f}")
    richer = fit(problem, best[None])
    evidence = compare(current, richer)
    force = effect_force(richer.problem, richer.x, lead.guise)
    refused = refusal(richer, lead.guise, evidence, force)
    if refused is None:
        evidence = compare(_return(current, richer), richer)
        refused = refusal(richer, lead.guise, evidence, force)
    return Step(richer, lead.guise, evidence, force, refused)


def _first_look(current: Fit, problem: ExtendedProblem, points: Floats) -> tuple[Floats, float]:
    """Short polishes at the present gain and at the likeliest one: where they end, and how much likelier that is."""
    gains, _ = gain_table(problem.samples.sample_time)
    first = polish_all(problem, points, current.found.gain, 6, ROUGH)
    index = losses_by_gain(problem, first.x, gains).argmin(axis=1)
    ends = polish_all(problem, first.x, gains[:, index], 6, ROUGH)
    return ends.x[ends.best], current.found.criterion - float(ends.loss[ends.best])


def _return(current: Fit, richer: Fit) -> Fit:
    """The poorer model once more from the richer one's optimum: what only polished the baseline is no evidence."""
    problem = current.problem
    x = np.zeros((1, problem.size))
    x[:, : problem.base] = richer.x[: problem.base]
    for other in problem.guises:
        x[:, problem.slot(other)] = richer.x[richer.problem.slot(other)]
    x[:, problem.p :] = richer.x[richer.problem.p :]
    again = fit(problem, x)
    return again if again.found.criterion < current.found.criterion else current


def refusal(fitted: Fit, guise: Guise, evidence: Comparison, force: float) -> str | None:
    """Why the effect does not earn its name, or None."""
    level = float(fitted.problem.law(fitted.x[None])[0, 0]) or fitted.problem.scales.force
    if evidence.bic > BIC:
        return f"evidence {-evidence.bic:.0f} is below {-BIC:.0f}"
    if evidence.z < (Z_STRONG if evidence.bic < BIC_STRONG else Z):
        return f"the evidence comes from few places (z = {evidence.z:.1f})"
    if force < SMALLEST * level:
        return f"its force of {force:.2g} is below {SMALLEST * level:.2g}"
    if evidence.free_run > FREE_RUN:
        return f"one-second predictions do not improve ({evidence.free_run:.2f})"
    if at_edge(fitted, guise):
        return "a parameter ended on its bound"
    return None


def at_edge(fitted: Fit, guise: Guise) -> bool:
    """True where an unknown of the effect ended on a bound that is not its absence."""
    low, high = fitted.problem.bounds
    slot = fitted.problem.slot(guise)
    x = fitted.x[slot]
    return bool(((x <= low[slot] + 1e-6) | (x >= high[slot] - 1e-6)).any())


def _price(fitted: Fit) -> float:
    """Bayes information criterion: loss plus the price of the unknowns. [1]."""
    return float(fitted.found.criterion) + fitted.problem.p * float(np.log(fitted.problem.samples.used))


def _reconsider(selection: Selection, guises: list[Guise], progress: Callable[[str], None]) -> None:
    """Put each effect to the test once the others are in: is it still needed, and is it still it and not a twin?

    A first name is chosen while the others are missing, and then shaped by what it stands in for.
    """
    for step in list(selection.steps[:-1]):
        rest = without(selection.chosen, step.guise)
        twins = TWINS.get(step.guise.name, frozenset()) | {step.guise.name}
        taken = {s.guise.name for s in selection.steps if s is not step}
        offered = [guise for guise in guises if guise.name in twins - taken]
        steps = [s for s in explore(rest, offered, progress, AGAIN) if s.refused is None]
        if not steps:
            selection.steps = [s for s in selection.steps if s is not step]
            selection.chosen = rest
        elif _price(steps[0].fit) < _price(selection.chosen):
            index = selection.steps.index(step)
            selection.steps[index], selection.rivals[index] = steps[0], steps
            selection.chosen = steps[0].fit


def without(fitted: Fit, guise: Guise) -> Fit:
    """The model refitted without one of its effects."""
    problem = fitted.problem
    rest = problem.including(tuple(other for other in problem.guises if other is not guise))
    bare = np.concatenate(
        [np.delete(fitted.x[: problem.p], np.arange(problem.p)[problem.slot(guise)]), fitted.x[problem.p :]]
    )
    return fit(rest, bare[None])


def tied(winner: Step, rivals: list[Step]) -> list[Step]:
    """Rivals that these data cannot tell from the winner."""
    best = _price(winner.fit)
    terms = winner.fit.terms()
    found = []
    for rival in rivals:
        if rival.guise.name == winner.guise.name or rival.evidence.bic > BIC:
            continue
        distance = _price(rival.fit) - best
        apart = block_z(terms - rival.fit.terms())
        share = rival.evidence.bic / min(winner.evidence.bic, -1e-9)
        if distance < TIED_BIC or (apart < TIED_Z and share > TIED_SHARE):
            found.append(rival)
    return found
