"""What is behind a change? Causes compete: each says which numbers move together; the data say which of them did. Pure.

Worn or dirty guides rub harder at every speed; a lubricant acts through its film: with speed where the film carries, at
low speed where it fails. A torque read too large scales friction, weight and inertia alike. A payload weighs. Physics
the model lacks shows as force left unexplained. Each cause is a set of shapes with unknown sizes; its score is the
likelihood of the change averaged over sizes that are usual (marginal likelihood), times what is believed beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from monitor.baseline import Baseline
from monitor.channels import ASYMMETRY, MASS, REFERENCES, UNEXPLAINED
from monitor.findings import Kind
from plant.recording import Floats

MISFIT = 0.01  # of friction: no change follows its textbook shape more closely
BENT = 0.08  # of the change itself: shapes shift with v_s, temperature, wear of one rail more than the other
LATENT_MISFIT = 0.15  # of the logarithm: unexplained force follows friction
ASYMMETRY_MISFIT = 0.01  # of friction: the two directions of a worn guide do not rub alike to better
USUAL = 0.3  # of friction: size of a change worth an alert
SCALE = 0.1  # usual error of a torque constant [1]
PAYLOAD, TORQUE = 0.2, 0.04  # beforehand: production changes loads every week, a torque constant changes with a repair
LOUDER = 1.2  # of the logarithm: usual growth of the unexplained force under a mismatch


@dataclass(frozen=True, slots=True)
class Cause:
    """One explanation.

    Attributes:
        kind: of the alert it would make.
        shape: key of the words an alert uses.
        prior: before anything was measured. [1]
        moves: unit changes of the numbers compared, (k, D), and how large each usually is (k,).
        usual: see `moves`.
        rising: the first move is a rise (True), a fall (False), or either (None).
    """

    kind: Kind
    shape: str
    prior: float
    moves: Floats
    usual: Floats
    rising: bool | None = None


@dataclass(frozen=True, slots=True)
class Verdict:
    """Scores of the competition.

    Attributes:
        kinds: probability-like score of each kind; they add up to 1. [1]
        shapes: the same of each cause.
        sizes: of the best cause's moves, in units of `moves`.
    """

    kinds: dict[str, float]
    shapes: dict[str, float]
    sizes: tuple[float, ...]

    @property
    def shape(self) -> str:
        """The likeliest cause."""
        return max(self.shapes, key=lambda name: self.shapes[name])


def compared(baseline: Baseline) -> list[int]:
    """Indices of the channels that tell causes apart: friction at the reference speeds, and what is no friction."""
    others = [baseline.index(name) for name in (ASYMMETRY, UNEXPLAINED, MASS)]
    return [*range(REFERENCES), *(index for index in others if index is not None)]


def causes_of(baseline: Baseline, weight: float, temperature_known: bool) -> Iterator[Cause]:
    """Every cause, as moves of the `compared` channels.

    Args:
        baseline: with the reference speeds.
        weight: of the moving mass on a vertical axis, 0 elsewhere. [N]
        temperature_known: the effect of temperature is corrected for already.
    """
    names = [baseline.channels[index].name for index in compared(baseline)]
    v, v_s, middle = np.array(baseline.speeds), baseline.stribeck_velocity, _middle(baseline)

    def move(friction: Floats | float = 0.0, **others: float) -> Floats:
        row = np.zeros(len(names))
        row[:REFERENCES] = friction
        for name, value in others.items():
            wanted = {"asymmetry": ASYMMETRY, "unexplained": UNEXPLAINED, "mass": MASS}[name]
            if wanted in names:
                row[names.index(wanted)] = value
        return row

    dry = move(middle * np.ones_like(v))
    level = move(middle * -np.expm1(-v / v_s))
    viscous = move(middle * v / v[-1])
    slow = move(middle * np.exp(-v / v_s))
    louder = move(unexplained=1.0)
    offset = move(asymmetry=middle)
    mass = _mass(baseline)
    scaled = move(baseline.friction, asymmetry=weight, mass=mass)

    def cause(kind: Kind, shape: str, prior: float, *moves: tuple[Floats, float], rising: bool | None = None) -> Cause:
        return Cause(kind, shape, prior, np.array([m for m, _ in moves]), np.array([u for _, u in moves]), rising)

    yield cause(Kind.WEAR, "dry friction", 0.2, (dry, USUAL), rising=True)
    yield cause(Kind.WEAR, "Coulomb level", 0.1, (level, USUAL), rising=True)
    yield cause(Kind.LUBRICATION, "viscous friction", 0.1 if temperature_known else 0.07, (viscous, USUAL))
    yield cause(Kind.LUBRICATION, "low-speed friction", 0.1, (slow, USUAL))
    yield cause(Kind.LUBRICATION, "film", 0.07, (slow, USUAL), (viscous, USUAL), (dry, USUAL / 3))
    yield cause(Kind.LUBRICATION, "less friction", 0.08, (dry, USUAL), rising=False)
    if not temperature_known:
        yield cause(Kind.OPERATING_POINT, "temperature", 0.04, (viscous, USUAL), (slow, USUAL / 3))
    if weight and ASYMMETRY in names:
        payload = move(asymmetry=weight, mass=mass)
        yield cause(Kind.OPERATING_POINT, "payload", PAYLOAD, (payload, 0.1), (dry, USUAL / 6), (louder, LOUDER / 3))
    elif ASYMMETRY in names:
        yield cause(Kind.OPERATING_POINT, "outside force", 0.05, (offset, USUAL), (dry, USUAL / 6))
    if mass:
        yield cause(Kind.OPERATING_POINT, "payload", PAYLOAD, (move(mass=mass), SCALE), (dry, USUAL / 6))
    if (weight and ASYMMETRY in names) or mass:
        yield cause(Kind.DATA_QUALITY, "torque scale", TORQUE, (scaled, SCALE), (louder, LOUDER / 3))
    if UNEXPLAINED in names:
        yield cause(
            Kind.MODEL_MISMATCH, "left-out physics", 0.15, (louder, LOUDER), (dry, USUAL / 6), (slow, USUAL / 6),
            rising=True,
        )  # fmt: skip


def compete(
    baseline: Baseline, change: Floats, covariance: Floats, weight: float = 0.0, temperature_known: bool = False
) -> Verdict:
    """Score every cause of a change.

    Args:
        baseline: with the reference speeds.
        change: of the `compared` channels. (D,)
        covariance: of `change`. (D, D)
        weight: of the moving mass on a vertical axis, 0 elsewhere. [N]
        temperature_known: the effect of temperature is corrected for already.
    """
    middle = _middle(baseline)
    names = [baseline.channels[index].name for index in compared(baseline)]
    tolerance = np.array([_tolerance(name, middle, _mass(baseline)) for name in names])
    tolerance[:REFERENCES] += (BENT * np.abs(change[:REFERENCES])) ** 2
    known = covariance + np.diag(tolerance)
    scores: dict[str, float] = {}
    kinds: dict[str, Kind] = {}
    sizes: dict[str, tuple[float, ...]] = {}
    for cause in causes_of(baseline, weight, temperature_known):
        evidence, size = _evidence(cause, change, known)
        scores[cause.shape] = float(np.logaddexp(scores.get(cause.shape, -np.inf), evidence + np.log(cause.prior)))
        kinds[cause.shape], sizes[cause.shape] = cause.kind, tuple(size.tolist())
    best = max(scores.values())
    shares = {name: float(np.exp(max(score - best, -200.0))) for name, score in scores.items()}
    total = sum(shares.values())
    shapes = {name: share / total for name, share in shares.items()}
    summed: dict[str, float] = {}
    for name, share in shapes.items():
        summed[kinds[name].value] = summed.get(kinds[name].value, 0.0) + share
    return Verdict(summed, shapes, sizes[max(shapes, key=lambda name: shapes[name])])


def _middle(baseline: Baseline) -> float:
    return float(abs(baseline.friction[REFERENCES // 2])) or 1.0


def _mass(baseline: Baseline) -> float:
    """Usual moving mass, 0 where it is not estimated. [kg or kg*m^2]"""
    return 0.0 if (index := baseline.index(MASS)) is None else float(abs(baseline.moments.mean_y[index]))


def _tolerance(name: str, middle: float, mass: float) -> float:
    if name == UNEXPLAINED:
        return LATENT_MISFIT**2
    if name == MASS:
        return (MISFIT * mass) ** 2
    return float(((ASYMMETRY_MISFIT if name == ASYMMETRY else MISFIT) * middle) ** 2)


def _evidence(cause: Cause, change: Floats, known: Floats) -> tuple[float, Floats]:
    """Logarithm of the marginal likelihood, and the likeliest sizes of the cause's moves."""
    prior = np.diag(cause.usual**2)
    whole = known + cause.moves.T @ prior @ cause.moves
    chol = np.linalg.cholesky(whole)
    rest = np.linalg.solve(chol, change)
    evidence = -0.5 * float(rest @ rest) - float(np.log(np.diag(chol)).sum())
    gain = prior @ cause.moves @ np.linalg.inv(whole)
    size = gain @ change
    if cause.rising is not None:
        from scipy.special import log_ndtr

        spread = float(np.sqrt(max((prior - gain @ cause.moves.T @ prior)[0, 0], 1e-30)))
        sign = 1.0 if cause.rising else -1.0
        evidence += float(log_ndtr(sign * size[0] / spread)) + float(np.log(2.0))
    return evidence, size
