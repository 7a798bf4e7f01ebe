"""The paper's identifications (§4.4-4.6, §5) with both readings of §4.3: its genetic algorithm beside our search."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.criterion import FREE
from identify.genetic import GeneticSettings
from identify.identification import identify_friction
from identify.output_error import output_error_search
from identify.paper_method import PaperProblem, to_unknowns
from identify.preprocess import prepare
from identify.result import IdentificationResult
from identify.search import genetic_search
from plant.recording import Recording
from tests.paper.simulations import (
    PAPER_OPTIMUM,
    SAMPLE_TIME,
    SUBSTEPS,
    TABLE_1,
    WINDOW,
    Case,
    excitation_of,
    half_travel,
    nearest_amplitude,
)

Floats = NDArray[np.float64]

DESIGN = GeneticSettings()  # §4.4: 50 individuals, Pm 0.03, crossover rate 0.5, 8 bits; 200 generations are ours
NAMES = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")
PRECISE = 0.1  # relative error of all four that we call "++"; the paper names no figure
SHARE = 0.95  # of the intervals of shares


@dataclass(frozen=True, eq=False)
class Identified:
    """What one search made of one recording.

    Attributes:
        values: F_c, F_s, v_s, F_v. (4,)
        errors: relative, against the truth. (4,)
        criterion: eq. (4). [1]
        worst: largest output error against the noise-free position. [m]
        output_error: measured minus estimated position. [m] (n,)
        best_criteria, best_values: the best so far after each generation. (g,), (g, 4)
    """

    values: Floats
    errors: Floats
    criterion: float
    worst: float
    output_error: Floats
    best_criteria: Floats = field(default_factory=lambda: np.empty(0))
    best_values: Floats = field(default_factory=lambda: np.empty((0, 4)))


def record(machine: Case, excitation: object, noise: float = 0.0, seed: int = 0) -> tuple[Recording, Floats]:
    """15 s of the machine's motion with white noise on the position, and the position without it. [m]"""
    t = SAMPLE_TIME * np.arange(WINDOW)
    clean = machine.run(excitation, WINDOW).position
    noisy = clean + noise * np.random.default_rng([seed, 12]).standard_normal(WINDOW)
    return Recording(t, machine.axis.mechanics.gain * excitation.torque(t), noisy, sample_time=SAMPLE_TIME), clean


def problem_of(machine: Case, recording: Recording, clean: Floats, fine: bool = True) -> PaperProblem:
    """The paper's problem: four unknowns in the box of ±50 %, the start known; `fine` takes the simulation's steps."""
    law = machine.friction.as_array
    start = np.array([[clean[0], 0.0]])
    problem = PaperProblem(prepare(recording, machine.axis), machine.axis, (0.5 * law, 1.5 * law), start)
    return problem.refined(SAMPLE_TIME / SUBSTEPS) if fine else problem


def output_errors(problem: PaperProblem, candidates: Floats) -> Floats:
    """Measured minus estimated positions of F_c, F_s, v_s, F_v (m, 4). [m] (n, m)"""
    return problem.errors(to_unknowns(problem, candidates), FREE)


def criteria(problem: PaperProblem, candidates: Floats) -> Floats:
    """Eq. (4), positions counted from the first sample. (m,)"""
    error = output_errors(problem, candidates)
    moved = problem.samples.position - problem.first_state[0, 0]
    return np.einsum("nm,nm->m", error, error) / float(moved @ moved)


def by_paper(
    machine: Case, recording: Recording, clean: Floats, seed: int, settings: GeneticSettings, *, fine: bool = False
) -> Identified:
    """The genetic algorithm of Fig. 5 with the design of §4.4; long steps do unless the input changes every sample."""
    problem = problem_of(machine, recording, clean, fine)
    low, high = problem.box
    ga, winners = genetic_search(
        lambda x: criteria(problem, x), (low, high), settings, np.random.default_rng([seed, settings.bits])
    )
    so_far = np.minimum.accumulate([value for value, _ in winners])
    first = np.searchsorted(-so_far, -so_far, side="left")
    history = np.array([x for _, x in winners])[first]
    return _described(machine, problem, recording, clean, ga.best, so_far, history)


def by_ours(machine: Case, recording: Recording, clean: Floats, seed: int) -> Identified:
    """Our genetic search and polish of the same criterion in the same box."""
    problem = problem_of(machine, recording, clean)
    found = output_error_search(problem, np.random.default_rng(seed))
    values = np.array([value for _, _, value, _, _ in problem.named(found.x)[:4]])
    return _described(machine, problem, recording, clean, values)


def _described(
    machine: Case, problem: PaperProblem, recording: Recording, clean: Floats, values: Floats, *history: Floats
) -> Identified:
    error = output_errors(problem, values[None])[:, 0]
    worst = float(np.abs(error - (recording.position - clean)).max())
    relative = np.abs(values / machine.friction.as_array - 1.0)
    return Identified(values, relative, float(criteria(problem, values[None])[0]), worst, error.copy(), *history)


def by_default(machine: Case, recording: Recording, seed: int) -> IdentificationResult:
    """Our default: seven unknowns, start and constant force among them, no box; intervals and verdict."""
    return identify_friction(recording, machine.axis, seed=seed)


def default_errors(machine: Case, result: IdentificationResult) -> Floats:
    """Relative errors of the default's F_c, F_s, v_s, F_v. (4,)"""
    return np.abs([result.parameters[name].value for name in NAMES] / machine.friction.as_array - 1.0)


def contained(machine: Case, result: IdentificationResult) -> list[bool | None]:
    """Whether each interval of the default holds the truth; None without an interval."""
    answers: list[bool | None] = []
    for name, truth in zip(NAMES, machine.friction.as_array, strict=True):
        interval = result.parameters[name].ci95
        answers.append(None if interval is None else interval[0] <= truth <= interval[1])
    return answers


def paper_errors(machine: Case) -> Floats:
    """Relative errors of the optimum printed in §4.4, in this reading. (4,)"""
    printed = np.array(PAPER_OPTIMUM)
    truth = machine.friction.as_array.copy()
    if machine.reading == "paper-bump":
        truth[1] -= truth[0]  # the paper's "F_s" is the bump
    return np.abs(printed / truth - 1.0)


def inputs_of_table_1(machine: Case) -> list[tuple[str, float, float, str, object]]:
    """Form, frequency, the paper's criterion and quality, and the input at the amplitude of §4.5 (±0.2 m)."""
    rows = []
    for form, frequency, criterion, quality in TABLE_1:

        def displacement(amplitude: float, form: str = form, frequency: float = frequency) -> float:
            return half_travel(machine.run(excitation_of(machine, form, frequency, amplitude), 4000))

        amplitude, _ = nearest_amplitude(displacement)
        rows.append((form, frequency, criterion, quality, excitation_of(machine, form, frequency, amplitude)))
    return rows


def share(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    z = 1.96
    p, n = hits / of, of
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)
