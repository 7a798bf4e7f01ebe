"""When an effect has earned its name, and when two explanations cannot be told apart.

Every threshold is here, with its unit and its reason; none was tuned on recordings of real machines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.compare import Comparison, Fit, block_z
from identify.mismatch.curve import CURVE
from identify.mismatch.guise import NO_FINDING, OWN_CURVE, STIFF, Guise, metre
from identify.mismatch.own_curves import LENGTHS
from identify.promoted import CONSTANT

Bools = NDArray[np.bool_]

BIC = -25.0  # evidence a name needs
Z, Z_STRONG, BIC_STRONG = 3.0, 2.5, -60.0  # agreement of the blocks, and what is enough where the evidence is strong
Z_LEAST = 2.0  # what is enough where the evidence is strong even without its most favourable blocks
SOFTEST = 1e-3  # of the upper bound of a stop's stiffness: there the catalogue's stops begin (1 kN/m)
ENDING = 0.15  # of the travel: a softer one is none unless it begins so near the end, and unseen data are for it
SMALLEST = 0.007  # of the dry friction: force, where it acts, of an effect that is worth a name
UNEVEN = 0.012  # of it, where unseen data do not foretell the effect: friction wanders by as much along the travel
TINIEST = 0.002  # of it, where the effect leaves hardly any error on unseen data, and they are likelier by it
HALF, QUARTER = 0.5, 0.25  # of the smallest size that is a finding: enough for such an effect, or for a sure one
FREE_RUN = 0.98  # eq. (4) over one second must fall at least to this share, on fitted and unseen data together
NO_WORSE = 1.015  # is enough where the evidence is strong: of a small effect in much noise, free runs see nothing
HELD_OUT = 1.02  # on unseen data it must not rise above this share
FORESEEN, FORESEEN_Z = 60.0, 3.0  # evidence of unseen data, sample by sample, and its z: for or against a name
FAINT, CONVINCING = -10.0, 250.0  # evidence that a name needs where that of unseen data, not fitted, is so much
SPOILS = 1.4  # on the fitted data, where the likelihood asked for the effect: a little more is how a start is known
SUPPORT = 0.15  # evidence per unseen sample over that per fitted one: less is no effect of the machine, unless it ...
DISTINCT = 0.5  # ... is what a name needs, or one-second predictions of unseen data are at least so much better
STILL = 0.95  # of the latent force: what leaves more leaves it as it was
UNFINISHED = 0.3  # share of both where the evidence is overwhelming: another effect may still spoil the unseen data
OVERWHELMING = -600.0  # evidence, without its best blocks, that needs no free run beside it
HARDLY = 0.85  # of the one-second error on unseen data: what leaves more tells little beyond what comes next
SLACK = 0.75  # of the latent force: what leaves more, and is not foretold, is no gap, but how the axis breaks away
MOST_PLACES = 4.0  # z of unseen data that tell a thing in most places
EVERYWHERE = 6.0  # z of fitted and of unseen data: a wave that all places tell alike needs no free run beside it
SOLVED = 0.3  # of the latent force: what leaves no more of it needs no free run beside overwhelming evidence
MUCH = 0.5  # of the latent force, or of the error on unseen data: what leaves less takes most of it
PROVEN = 0.1  # share of the one-second error on unseen data: a name that leaves no more is hardly another's shadow
TRUER = 0.25  # of what a name leaves: physics in no catalogue that is likelier and leaves no more takes even that name;
# of the error on unseen data: what leaves no more, and is overwhelming, is there however small it is
NEARER = 0.45  # of the errors of one-second runs: what lasts and was not there left 49 % of them and more
CLEARER = 0.65  # of them, of all data: what leaves no more, and most places agree on, is no matter of shapes
LEAD = 0.15  # of its evidence: what is so much likelier than a name is likelier for how that name's shape differs
BY_HALF = 1.5  # times the evidence of all data that such physics has: a name with that is preferred in any case
FAR, FAR_TRUER = 1.25, 0.5  # with so many times its evidence, it need leave only so little
SPOILED = 1.5  # times the evidence of the best name: what is refused in spite of that leaves nothing to name
DISPUTED = 1.1  # of the error on unseen data: what leaves no more, and makes them no less likely, they do not deny
TIED_BIC, TIED_Z, TIED_SHARE = 25.0, 2.5, 0.6  # rivals closer than this cannot be told apart
KNOWN = 0.1  # of the evidence: how well the catalogue knows the shapes of its effects; less tells no names apart
CLEAN = 0.013  # of the dry friction: latent force of a complete model, at most
CLEARLY = 0.7  # of the one-second error on unseen data: what leaves less predicts clearly better
STRAY = 12.0  # times the error of a model fitted to it: what leaves more does not explain what is held out
OWN_SHAPE = 0.05  # of a name's evidence: physics in no catalogue that has so little more mends its shape
LESSER = 0.03  # of the evidence so far: less is how imperfectly the shapes of what was named are known

SAME = {"force_offset", "coulomb_asymmetry"}  # a constant force, while the axis slides
LATE = {"actuator_lag": "time_constant", "dead_time": "delay"}  # together they may be one lag of a higher order

LIMITS = {"torque_saturation", "end_stop"}  # do nothing where the axis or its drive does not go

BREAK_AWAY = {"dwell_time_stiction"}  # decide when the axis leaves a rest: a baseline takes them for static friction
BENDS, MINUTE = 0.6, 0.25  # of the latent force, at most, and of STIFF: what overwhelming evidence may leave and be
OWN_DRY = 0.02  # of F_s: dry friction that friction which grows with the load leaves at least
BRISTLES = "presliding_hysteresis"
GAP = "backlash"
DAMPED = 3.0  # times the critical damping: bristles that are damped more are none
ON_BOUND = "a parameter ended on its bound"  # reason that a likely effect gets no name
NO_NAME = "it is in no catalogue"  # reason that likely physics gets none
ODD = "its force of", "a parameter ended", "its size of"
LIKELY_BUT = (*ODD, OWN_CURVE, NO_NAME)  # beginnings of the reasons a likely effect is refused


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One more effect on top of a fit.

    Attributes:
        fit: with the effect.
        guise: the effect.
        evidence: what speaks for it.
        force_rms: its force over the motion. [N]
        refused: why it does not earn its name, or None.
        acting: its force where it acts. [N]
    """

    fit: Fit
    guise: Guise
    evidence: Comparison
    force_rms: float
    refused: str | None
    acting: float = 0.0

    @property
    def small(self) -> bool:
        """True where the effect is likely, but smaller than what is a finding by itself."""
        return self.misplaced and (self.refused or "").endswith(NO_FINDING)

    @property
    def denied(self) -> str:
        """How the own curve of a likely effect, free to bend, is no such effect's; empty where it is."""
        return (self.refused or "").partition(f"{OWN_CURVE}: ")[2]

    @property
    def misplaced(self) -> bool:
        """True where the effect is likely, but too small or too strange to be what it is called."""
        return self.refused is not None and self.refused.startswith(LIKELY_BUT)


def refusal(fitted: Fit, guise: Guise, evidence: Comparison, force: float) -> str | None:
    """Why the effect does not earn its name, or None."""
    if evidence.bic > (FAINT if told_elsewhere(evidence) else BIC):
        return f"evidence {-evidence.bic:.0f} is below {-BIC:.0f}"
    if not agreed(evidence):
        return f"the evidence comes from few places (z = {evidence.z:.1f})"
    if evidence.foreseen < 0.0 and evidence.foreseen_z < -FORESEEN_Z:
        return f"it makes data it has not seen less likely (z = {evidence.foreseen_z:.1f})"
    hardly = evidence.support < SUPPORT and evidence.foreseen < -BIC and evidence.unseen > DISTINCT
    if hardly and not unreached(guise.name, evidence):
        return f"data it has not seen hardly speak for it (evidence {evidence.foreseen:.0f})"
    if guise.name == GAP and evidence.lacking > SLACK and not foretold(evidence):
        return f"it leaves {evidence.lacking:.0%} of the latent force: no gap is so small a part of what is missing"
    if not _hidden_state(guise, evidence):
        both = float(np.sqrt(evidence.free_run * evidence.unseen))
        if both > (NO_WORSE if evidence.bic < BIC_STRONG else FREE_RUN):
            return f"one-second predictions do not improve ({both:.2f})"
        if evidence.free_run > SPOILS and evidence.steady > OVERWHELMING:
            return f"the fitted data themselves are predicted worse ({evidence.free_run:.2f})"
        if evidence.unseen > HELD_OUT and not (both < UNFINISHED and evidence.steady < OVERWHELMING):
            return f"data it has not seen are predicted worse ({evidence.unseen:.2f})"
    return misplacement(fitted, guise, evidence, force)


def misplacement(fitted: Fit, guise: Guise, evidence: Comparison, force: float, *, twice: bool = False) -> str | None:
    """Why a likely effect is too small or too strange to be what it is called, or None.

    Args:
        fitted: with the effect.
        guise: the effect.
        evidence: what speaks for it.
        force: where it acts. [N]
        twice: whether another recording tells the same, with the same sizes: of a soft stop that is enough.
    """
    sure = proven(evidence)
    least = (TINIEST if sure else SMALLEST if foretold(evidence) else UNEVEN) * fitted.dry_level
    if force < least:
        return f"its force of {force:.2g} is below {least:.2g}"
    if guise.depends is not None:
        return "nothing of it is left" if at_edge(fitted, guise) else NO_NAME
    own = guise.oddity(fitted.x[fitted.problem.slot(guise)], finding(guise.name, evidence))
    odd = (
        own
        or _too_soft(fitted, guise, evidence, twice=twice)
        or _too_hard(fitted, guise, evidence)
        or _too_lasting(fitted, guise)
        or _too_much(fitted, guise)
    )
    if odd is None and at_edge(fitted, guise):
        return ON_BOUND
    return odd or _too_damped(fitted, guise)


def finding(name: str, evidence: Comparison) -> float:
    """Share of the smallest size that is a finding which this effect needs: less where unseen data are sure of it. [1]

    A mass of 0.4 % that leaves a fifth of the error was there; other physics that looked like one left two thirds.
    """
    sure = overwhelming(evidence)
    if name in LATE or not (sure or proven(evidence)):
        return 1.0
    return QUARTER if sure and evidence.unseen < TRUER else HALF


def _too_soft(fitted: Fit, guise: Guise, evidence: Comparison, *, twice: bool) -> str | None:
    """Why a stop is none: it is softer than the catalogue's stops, a spring along part of the travel; or None.

    The catalogue says in N/m how soft they are; of a rotary axis' stops, unseen data or another recording must. Nor is
    one where the travel ends and another recording finds it, too.
    """
    if guise.name != "end_stop":
        return None
    x = fitted.x[fitted.problem.slot(guise)]
    stiffness, least = guise.value(x, "stiffness"), SOFTEST * guise.unknown("stiffness").high
    depth = abs(guise.value(x, "position") - guise.unknown("position").origin)
    at_end = depth < ENDING * fitted.problem.scales.travel
    solved = evidence.unseen < PROVEN
    told = evidence.steady < OVERWHELMING or (evidence.foreseen_z > FORESEEN_Z and evidence.unseen < CLEARLY)
    sure = twice or solved or (evidence.foreseen > FORESEEN and told)
    if stiffness >= least or (at_end and sure) or (fitted.problem.axis.is_rotary and (twice or solved)):
        return None
    return f"its size of {stiffness:.3g} is below {least:.3g}: no stop is that soft"


def _too_hard(fitted: Fit, guise: Guise, evidence: Comparison) -> str | None:
    """Why bristles are none: friction slides before they have bent by what any contact does; or None.

    Rolling contacts bend by ten micrometres, too (Futami et al. 1990): there the evidence must be overwhelming, and
    most of what was left over gone.
    """
    if guise.name != BRISTLES:
        return None
    stiffness = guise.value(fitted.x[fitted.problem.slot(guise)], "bristle_stiffness")
    bend = fitted.dry_level / stiffness
    least = STIFF * metre(fitted.problem.axis, fitted.problem.scales.travel)
    if overwhelming(evidence) and evidence.lacking < BENDS and evidence.unseen < SLACK:
        least *= MINUTE
    return f"its size of {bend:.2g} is below {least:.2g}: so little bends any contact" if bend < least else None


def _too_damped(fitted: Fit, guise: Guise) -> str | None:
    """Why bristles are none: they are damped as no contact is, so that their force follows the speed; or None.

    LuGre's damping is near the critical one (Canudas de Wit et al. 1995).
    """
    if guise.name != BRISTLES:
        return None
    ratio = guise.damping_ratio(fitted.x[fitted.problem.slot(guise)], fitted.problem.scales.mass)
    return None if ratio <= DAMPED else f"its size of {ratio:.2g} times the critical damping: no contact is so damped"


def _too_lasting(fitted: Fit, guise: Guise) -> str | None:
    """Why stiction does not grow at rest: contacts break within less than what follows the rest here; or None.

    Those that age ever more slowly may take several slip lengths, others no more than one.
    """
    if guise.name != "dwell_time_stiction":
        return None
    x, slip = fitted.x[fitted.problem.slot(guise)], guise.unknowns[-1]
    longest = slip.high
    if guise.shapes:
        longest *= (1.0 + (LENGTHS - 1.0) * min(guise.value(x, "slows"), 1.0)) / LENGTHS
    if guise.value(x, slip.parameter) < 0.999 * longest:
        return None
    return f"its size of {longest:.2g} of slip is on its bound: what follows the rest is no broken contact"


def _too_much(fitted: Fit, guise: Guise) -> str | None:
    """Why friction does not grow with the force that is transmitted: nothing of what does not is left; or None.

    Seals, preload and grease rub whatever is transmitted; what takes all of it is another thing that eq. (1) imitates.
    """
    if guise.name != "load_dependent_friction":
        return None
    coulomb, static = (float(x) for x in fitted.x[:2])
    left = coulomb / max(static, 1e-300)
    return f"its size of {left:.2g} of dry friction that is left is below {OWN_DRY:.2g}" if left < OWN_DRY else None


def _hidden_state(guise: Guise, evidence: Comparison) -> bool:
    """True where free runs cannot judge: a most likely spring or gap, whose state at a restart nobody knows.

    Nor of a wave that all data, sample by sample, tell in all places: a free run that errs by a part of its period has
    it at the wrong places.
    """
    stiff = guise.stiff and evidence.z > Z and evidence.steady < OVERWHELMING
    everywhere = min(evidence.z, evidence.foreseen_z) > EVERYWHERE and lasting(evidence)
    return stiff or (guise.wave is not None and everywhere) or decided(evidence)


def decided(evidence: Comparison) -> bool:
    """True where free runs have no say: sample by sample, all data are far likelier and most latent force is gone.

    A light axis with much friction breaks away a little early or late, whatever the model: its free runs err by that.
    """
    return overwhelming(evidence) and evidence.z > Z and evidence.lacking < SOLVED


def overwhelming(evidence: Comparison) -> bool:
    """True where fitted and unseen data, without the best blocks of either, are far likelier, and agree on it.

    Unseen ones by themselves, or nearly so and together with the fitted ones.
    """
    together = evidence.foreseen_z > Z_LEAST and evidence.z + evidence.foreseen_z > 2.0 * FORESEEN_Z
    return lasting(evidence) and (together or foretold(evidence))


def lasting(evidence: Comparison) -> bool:
    """True where fitted and unseen data are far likelier without the best blocks of either."""
    return evidence.steady < OVERWHELMING and evidence.again > -OVERWHELMING


def fills(evidence: Comparison) -> bool:
    """Whether most of the latent force is gone with an effect, and not by its best blocks."""
    return evidence.lacking < MUCH and evidence.steady < OVERWHELMING


def unreached(name: str, evidence: Comparison) -> bool:
    """Whether a limit fills most of what is missing, and unseen data, silent on it, stay within."""
    return name in LIMITS and fills(evidence) and abs(evidence.foreseen) < -BIC


def agreed(evidence: Comparison) -> bool:
    """True where the blocks of the recording agree.

    An effect that acts in few places has uneven evidence; it counts where enough is left without the best blocks (of
    the unseen data too, where it is very uneven; of overwhelming evidence, anything), or where unseen data are so much
    likelier, or predicted so much better, that nothing else needs to agree.
    """
    if evidence.z >= (Z_STRONG if evidence.bic < BIC_STRONG else Z):
        return True
    if evidence.unseen < PROVEN and evidence.foreseen_z > Z_LEAST:
        return True
    if foretold(evidence):
        return True
    if evidence.steady < OVERWHELMING and evidence.foreseen > CONVINCING and evidence.again > 0.0:
        return True
    return evidence.steady < BIC_STRONG and (evidence.z >= Z_LEAST or evidence.again > FORESEEN)


def all_told(evidence: Comparison) -> float:
    """Evidence of fitted data, and of unseen ones where they are clearly for it. [1]."""
    return -evidence.bic + (evidence.foreseen if foretold(evidence) else 0.0)


def told_elsewhere(evidence: Comparison) -> bool:
    """True where unseen data are so much likelier, and predicted so much better, that fitted ones need tell little."""
    return evidence.foreseen > CONVINCING and evidence.foreseen_z > FORESEEN_Z and evidence.unseen < DISTINCT


def told_more_elsewhere(evidence: Comparison) -> bool:
    """True where unseen data, clearly better predicted, tell more of it than fitted ones, which tell it strongly."""
    places = evidence.foreseen_z > FORESEEN_Z or evidence.again > CONVINCING
    return _more_elsewhere(evidence) and places and evidence.unseen < CLEARLY


def told_in_most_places(evidence: Comparison) -> bool:
    """True where unseen data tell more of it than fitted ones, in most places, and are predicted a little better."""
    return _more_elsewhere(evidence) and evidence.foreseen_z > MOST_PLACES and evidence.unseen < HARDLY


def _more_elsewhere(evidence: Comparison) -> bool:
    """Whether unseen data have more evidence than fitted ones, which have much."""
    return evidence.foreseen > -evidence.bic > -BIC_STRONG


def foretold(evidence: Comparison) -> bool:
    """True where unseen data, sample by sample, are clearly likelier, and agree on it."""
    return evidence.foreseen > FORESEEN and evidence.foreseen_z > FORESEEN_Z


def proven(evidence: Comparison) -> bool:
    """True where unseen data are foretold, and so well that nothing else is needed."""
    return foretold(evidence) and evidence.unseen < PROVEN


def nearer(evidence: Comparison) -> bool:
    """True where one-second runs of all data end far nearer, and unseen data, too, are likelier sample by sample.

    Or nearer, where fitted data agree in most places, and unseen ones are clearly likelier.
    """
    runs = float(np.sqrt(evidence.free_run * evidence.unseen))
    far = runs < NEARER and evidence.foreseen > -BIC
    return evidence.bic < BIC and (far or (runs < CLEARER and evidence.z > Z and evidence.foreseen > FORESEEN))


def everywhere(evidence: Comparison) -> bool:
    """True where unseen data tell it in all places alike, and half of their error is gone: no mood of friction."""
    return foretold(evidence) and evidence.foreseen_z > EVERYWHERE and evidence.unseen < MUCH


def strong(step: Step) -> bool:
    """Whether a step's evidence is strong, and unseen data are predicted clearly better."""
    return step.evidence.bic < BIC_STRONG and step.evidence.unseen < CLEARLY


def telling(step: Step) -> bool:
    """Whether what has no name here is worth telling all the same: no chance, and not without consequence.

    Two of three say the former: strong evidence, better predictions, likelier unseen data; or that most of the force is
    gone. But friction that wanders gives evidence for anything, which takes nothing from the latent force nor from the
    error.
    """
    told = step.evidence
    likelier = foretold(told) or overwhelming(told)
    no_chance = fills(told) or sum((told.bic < BIC_STRONG, told.unseen < CLEARLY, likelier)) >= 2
    return no_chance and not (told.lacking > STILL and told.unseen > HARDLY)


def at_edge(fitted: Fit, guise: Guise) -> bool:
    """True where an unknown of the effect that is reported ended on a bound that is not its absence."""
    told = [guise.wave is not None or guise.tells(unknown.parameter) for unknown in guise.unknowns]
    spared = np.array([unknown.log and guise.optional(unknown.parameter) for unknown in guise.unknowns])
    return _on_bound(fitted, guise, np.array(told) & ~_shapes(guise), spared)


def bent_to_edge(fitted: Fit, guise: Guise) -> bool:
    """True where the effect's own curve is bent as far as it may be; one that is straight where that begins is not."""
    straight = np.array([unknown.low == 0.0 for unknown in guise.unknowns])
    endless = np.array([unknown.parameter in guise.endless for unknown in guise.unknowns])
    return _on_bound(fitted, guise, _shapes(guise) & ~endless, straight)


def _shapes(guise: Guise) -> Bools:
    """Which unknowns say how the effect's own curve bends. (q,)"""
    return np.array([unknown.parameter in guise.shapes for unknown in guise.unknowns])


def _on_bound(fitted: Fit, guise: Guise, asked: Bools, spared: Bools) -> bool:
    """True where one of the unknowns that are `asked` (q,) ended on a bound, but the lower one of those `spared`."""
    low, high = fitted.problem.bounds
    slot = fitted.problem.slot(guise)
    x = fitted.x[slot]
    return bool((asked & (((x <= low[slot] + 1e-6) & ~spared) | (x >= high[slot] - 1e-6))).any())


def price(fitted: Fit) -> float:
    """Bayes information criterion: loss plus the price of the unknowns. [1]."""
    return float(fitted.found.criterion) + fitted.problem.p * float(np.log(fitted.problem.samples.used))


def beyond(fitted: Fit) -> bool:
    """True where a constant force is left that the axis file does not allow: it will need a name of its own."""
    problem = fitted.problem
    if not problem.gravity_known or SAME & set(fitted.names):
        return False
    allowed = problem.ordinary_constant
    if abs(float(fitted.x[CONSTANT])) * problem.scales.force <= allowed:
        return False
    value, half = constant_of(fitted)
    return abs(value) - half > allowed


def constant_of(fitted: Fit) -> tuple[float, float]:
    """The constant force and the half-width of its interval. [N]"""
    scale = fitted.problem.scales.force
    unit = np.zeros((1, len(fitted.x)))
    unit[0, CONSTANT] = scale
    return float(fitted.x[CONSTANT] * scale), float(fitted.spread.half_widths(unit)[0])


def cost(fitted: Fit) -> float:
    """The same, and the price of a constant force that will need a name. [1]."""
    return price(fitted) + (float(np.log(fitted.problem.samples.used)) if beyond(fitted) else 0.0)


def best_of(steps: list[Step]) -> Step | None:
    """The likeliest step that earned its name, unless something likelier did not: then nothing is named.

    Among those that fitted data tell nearly as well as the shapes of effects are known, all data may clearly decide.
    """
    accepted = [step for step in steps if step.refused is None]
    if not accepted:
        return None
    best = min(accepted, key=lambda step: cost(step.fit))
    near = [step for step in accepted if cost(step.fit) < cost(best.fit) - KNOWN * best.evidence.bic]
    truest = min(near, key=_cost_of_all)
    best = truest if _cost_of_all(truest) < _cost_of_all(best) - TIED_BIC else best
    left = best.evidence.unseen
    for step in steps:
        if _of_other_data(step, best):
            continue
        stranger = step.refused == NO_NAME
        by = clear_lead(step, best)
        likelier = step.misplaced and cost(step.fit) < cost(best.fit) - by and not outdone(step, best)
        foretells = stranger and step.evidence.unseen < left and _cost_of_all(step) < _cost_of_all(best) - by
        far = step.evidence.bic < FAR * best.evidence.bic and step.evidence.foreseen > best.evidence.foreseen
        truer = left > PROVEN or (stranger and step.evidence.unseen < (FAR_TRUER if far else TRUER) * left)
        if (likelier or foretells) and truer:
            return None
        refused = step.refused is not None and step.guise.name != CURVE  # how friction bends comes beside anything
        if refused and step.evidence.z > Z and step.evidence.bic < SPOILED * best.evidence.bic:
            return None
    return best


def clear_lead(odd: Step, best: Step) -> float:
    """By how much likelier than a name something must be to be no part of how imperfectly its shape is known. [1].

    Physics in no catalogue, or an effect stretched to its bound: a place as wide as can be instead of a slope.
    """
    stretched = odd.refused in (NO_NAME, ON_BOUND)
    return max(TIED_BIC, OWN_SHAPE * all_told(best.evidence)) if stretched else TIED_BIC


def _of_other_data(odd: Step, best: Step) -> bool:
    """Whether what is refused explains something else than a name: nothing of a second that the name foretells."""
    told, ours = odd.evidence, best.evidence
    better = ours.unseen < DISTINCT and 0.0 <= told.foreseen < ours.foreseen
    return odd.refused not in (None, NO_NAME) and told.unseen > HARDLY and better


def outdone(stranger: Step, best: Step) -> bool:
    """Whether a name is preferred by unseen data in every way to what is likelier and cannot be what it is called.

    Physics in no catalogue must only be a little likelier, or all data together tell the name by half more; what else
    is odd must be less likely of all data together.
    """
    told, ours = stranger.evidence, best.evidence
    if told.unseen <= ours.unseen or told.foreseen >= ours.foreseen:
        return False
    if stranger.refused == NO_NAME:
        by_half = ours.foreseen - ours.bic > BY_HALF * (told.foreseen - told.bic)
        return told.bic > (1.0 + LEAD) * ours.bic or by_half
    return _cost_of_all(stranger) > _cost_of_all(best) + TIED_BIC


def disputed(winner: Step, rival: Step) -> bool:
    """Whether fitted data prefer a rival that unseen data neither tell nor deny, though these tell the winner."""
    told = rival.evidence
    named = rival.guise.depends is None and not rival.misplaced and agreed(told)
    return named and cost(rival.fit) < cost(winner.fit) - TIED_BIC and told.foreseen >= 0.0 and told.unseen < DISPUTED


def _cost_of_all(step: Step) -> float:
    """Price of a step less the evidence of unseen data: how unlikely it makes all of them. [1]."""
    return cost(step.fit) - step.evidence.foreseen


def hardly_late(fitted: Fit) -> bool:
    """Whether a model has a delay too short to be told: how its two channels are stamped, or any drive's lag."""
    late = [guise for guise in fitted.problem.guises if guise.name in LATE]
    return any(guise.oddity(fitted.x[fitted.problem.slot(guise)]) is not None for guise in late)


def slight_delay(steps: list[Step]) -> Step | None:
    """A delay too short to be told, where nothing explains much more; every drive has one.

    Physics in no catalogue may explain a little more: a drive that creeps up to what it is told has a delay, too.
    """
    told = [s for s in steps if s.guise.name in LATE and s.evidence.bic < BIC and s.evidence.z > Z]
    slight = [s for s in told if s.guise in s.fit.problem.guises and hardly_late(s.fit)]
    if not slight:
        return None
    delay, best = min(slight, key=lambda step: price(step.fit)), best_of(steps)
    strangers = min((price(step.fit) for step in steps if step.refused == NO_NAME), default=np.inf)
    named = price(best.fit) if best is not None else np.inf
    lead = max(2.0 * TIED_BIC, -LEAD * delay.evidence.bic)
    likely = price(delay.fit) < min(named + 2.0 * TIED_BIC, strangers + lead)
    return delay if likely else None


def other_curve(steps: list[Step]) -> Step | None:
    """Another exponent in eq. (1), where nothing explains more: how friction falls with speed, which is no effect."""
    found = [step for step in steps if step.guise.name == CURVE and step.refused == NO_NAME]
    bent = next((step for step in found if step.evidence.bic < BIC_STRONG and agreed(step.evidence)), None)
    if bent is None or bent.evidence.foreseen < 0.0:
        return None
    others = [step for step in steps if step is not bent and not step.small]
    likely = [step for step in others if step.refused is None or step.misplaced]
    return bent if cost(bent.fit) < min((cost(step.fit) for step in likely), default=np.inf) else None


def fine_bristles(steps: list[Step]) -> Step | None:
    """Bristles as stiff as the samples can tell, where nothing explains more: every contact bends before it slides.

    By micrometres; how much is no finding, but what it does to each reversal hides what is one.
    """
    found = [step for step in steps if step.guise.name == BRISTLES and step.guise in step.fit.problem.guises]
    fine = next((step for step in found if step.refused == ON_BOUND and _stiffest(step)), None)
    if fine is None or fine.evidence.bic > BIC_STRONG or not agreed(fine.evidence) or not foretold(fine.evidence):
        return None
    likely = [step for step in steps if step is not fine and (step.refused is None or step.misplaced)]
    return fine if cost(fine.fit) < min((cost(step.fit) for step in likely), default=np.inf) else None


def _stiffest(step: Step) -> bool:
    """Whether the first unknown of a step ended on its upper bound."""
    first = step.fit.problem.slot(step.guise).start
    return bool(step.fit.x[first] >= step.fit.problem.bounds[1][first] - 1e-6)


def tied(winner: Step, rivals: list[Step]) -> list[Step]:
    """Rivals that these data cannot tell from the winner.

    One that is nearly as likely is among them, and one that all data together make as likely where it predicts unseen
    data better; one that only explains nearly as much, or as evenly, is not where it predicts unseen data worse than no
    effect at all and the winner does not.
    """
    best = cost(winner.fit)
    terms = winner.fit.terms()
    found = []
    for rival in rivals:
        if rival.guise.name == winner.guise.name or rival.evidence.bic > BIC:
            continue
        distance = cost(rival.fit) - best
        apart = block_z(terms - rival.fit.terms())
        share = rival.evidence.bic / min(winner.evidence.bic, -1e-9)
        similar = distance < -KNOWN * winner.evidence.bic or (apart < TIED_Z and share > TIED_SHARE)
        worse, own = (max(one.evidence.unseen, one.evidence.second) for one in (rival, winner))
        spoils = worse > HELD_OUT >= own
        foretells = worse < own and _cost_of_all(rival) < _cost_of_all(winner) + TIED_BIC
        if distance < TIED_BIC or foretells or (similar and not spoils):
            found.append(rival)
    return found
