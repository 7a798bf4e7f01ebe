"""The paper's own answer: §5's preprocessing, eq. (4) over one free run, the genetic algorithm of Fig. 5.

It is the floor other methods are measured against: the paper's optima err by up to 20 % (§4.4). It gives no intervals.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from identify.criterion import free_run_criterion
from identify.genetic import GeneticSettings
from identify.preprocess import Samples, prepare
from identify.problem import FINEST_SUBSTEP, FrictionProblem
from identify.result import IdentificationResult, Parameter, Verdict
from identify.search import genetic_search
from plant.axis import Axis
from plant.recording import Recording

Floats = NDArray[np.float64]

CUT_OFF = 2.0  # Hz, §5
ORDER = 4
FRICTION = 4  # unknowns: the paper assumes everything else known


class PaperProblem(FrictionProblem):
    """The paper's problem (§4.4): four unknowns within a box; the start, the mass and gravity are known."""

    def __init__(self, samples: Samples, axis: Axis, box: tuple[Floats, Floats], first_state: Floats) -> None:
        """Unknowns F_c, F_s [N], v_s [m/s], F_v [N·s/m] between the ends of `box` (4,); first_state (1, 2)."""
        super().__init__(samples, axis, first_state=first_state)
        self.box = box

    def refined(self, longest_substep: float = FINEST_SUBSTEP) -> PaperProblem:
        """The same problem marched in other steps."""
        other = PaperProblem(self.samples, self.axis, self.box, self.first_state)
        other.substeps = max(1, int(np.ceil(self.samples.sample_time / longest_substep - 1e-9)))
        return other

    @cached_property
    def bounds(self) -> tuple[Floats, Floats]:
        """The box in scaled unknowns; all others are held at zero. (size,) each"""
        low, high = np.zeros(self.size), np.zeros(self.size)
        low[:FRICTION], high[:FRICTION] = to_unknowns(self, np.array(self.box))[:, :FRICTION]
        return low, high


def filter_and_centre(samples: Samples, cut_off: float = CUT_OFF) -> Samples:
    """Zero-phase low-pass of force and position, both centred: gravity goes with the mean (§5).

    Centring is exact only for symmetric friction and periodic motion; it is the paper's way, not the default.
    """
    sections = butter(ORDER, min(cut_off * 2.0 * samples.sample_time, 0.99), output="sos")

    def smooth(x: Floats) -> Floats:
        y = sosfiltfilt(sections, x)
        return np.asarray(y - y.mean(), dtype=np.float64)

    return dataclasses.replace(samples, force=smooth(samples.force), position=smooth(samples.position))


def identify_as_in_the_paper(
    recording: Recording,
    axis: Axis,
    *,
    seed: int = 0,
    settings: GeneticSettings | None = None,
    bounds: tuple[Floats, Floats] | None = None,
    preprocess: bool = True,
) -> IdentificationResult:
    """Search the four friction parameters as §3 and §4.4 do.

    Args:
        recording: usable samples; only the longest run between gaps is used, for eq. (4) knows one run.
        axis: its constants; the mass is taken as known, a strong hypothesis by the paper's own judgement (§5).
        seed: of the search, which it repeats bit by bit.
        settings: default the design of §4.4 with 200 generations.
        bounds: lowest and highest F_c, F_s [N], v_s [m/s], F_v [N·s/m]; default from the sizes in the recording.
        preprocess: filter and centre as in §5; False for noise-free simulations as in §4.
    """
    samples = _longest_run(prepare(recording, axis))
    if preprocess:
        samples = filter_and_centre(samples)
        axis = dataclasses.replace(axis, mechanics=dataclasses.replace(axis.mechanics, g=0.0))
    settings = settings or GeneticSettings()
    problem = FrictionProblem(samples, axis)
    low, high = _default_bounds(problem) if bounds is None else bounds

    def criterion(candidates: Floats) -> Floats:
        return free_run_criterion(problem, to_unknowns(problem, candidates))

    ga, _ = genetic_search(criterion, (low, high), settings, np.random.default_rng(seed))
    rows = problem.named(np.zeros(problem.size))[:FRICTION]
    parameters = {
        name: Parameter(name, float(value), unit, None, False, bool(value in (a, b)))
        for (name, unit, *_), value, a, b in zip(rows, ga.best, low, high, strict=True)
    }
    return IdentificationResult(
        verdict=Verdict.IDENTIFIED,
        reason=None,
        axis=axis.name,
        parameters=parameters,
        criterion=ga.best_criterion,
        held_out_criterion=None,
        method="paper",
        evaluations=ga.generation * settings.population,
        seed=seed,
        samples=len(samples),
        start=float(recording.t[0]),
        end=float(recording.t[-1]) + recording.period,
        preprocessing=(*samples.removed, *((f"{CUT_OFF:g} Hz low-pass, centred",) if preprocess else ())),
    )


def _longest_run(samples: Samples) -> Samples:
    """The longest piece without a gap."""
    first = [*samples.first.tolist(), len(samples)]
    longest = int(np.argmax(np.diff(first)))
    return samples.part(first[longest], first[longest + 1])


def _default_bounds(problem: FrictionProblem) -> tuple[Floats, Floats]:
    """Physical ranges from the largest force and speed in the recording."""
    force, speed = problem.scales.force, problem.scales.speed
    return np.array([0.0, 0.0, 0.01 * speed, 0.0]), np.array([force, 1.5 * force, speed, force / speed])


def to_unknowns(problem: FrictionProblem, candidates: Floats) -> Floats:
    """Physical F_c, F_s, v_s, F_v (m, 4) as unknowns (m, size); no constant force, mass and start as given."""
    force, speed = problem.scales.force, problem.scales.speed
    x = np.zeros((len(candidates), problem.size))
    x[:, 0], x[:, 1] = candidates[:, 0] / force, candidates[:, 1] / force
    x[:, 2] = np.log(candidates[:, 2] / speed)
    x[:, 3] = candidates[:, 3] * speed / force
    return x
