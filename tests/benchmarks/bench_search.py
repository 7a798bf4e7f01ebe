"""Search bench: who finds the optimum of eq. (4), with how many evaluations, how fast? `make bench-search`.

Everybody minimises the same compiled criterion (peers in whole populations) on the problems of `search_study.py`, in
one process and on one core. Peers stop as soon as they are within 1 % of the best criterion anybody found, which they
could not know; ours and the paper's stop by themselves. Budget: 6000 evaluations. Times are CPU times.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import dataclasses
import importlib
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import differential_evolution

from identify.criterion import FREE
from identify.genetic import GeneticSettings
from identify.identification import identify_friction
from identify.output_error import output_error_search
from identify.paper_method import to_unknowns
from identify.polish import polish_all
from identify.search import genetic_search
from plant.recording import Recording
from tests.benchmarks.search_study import SUCCESS, Case, criterion, draw
from tests.benchmarks.test_bench_plant import DT, FLAGS, FORCE, LAW, SUBSTEPS, M, N
from tests.benchmarks.test_bench_plant import ours as ours_march
from tests.identify.studies.machines import Setting, draw_case

BUDGET = 6000
WINDOWS = {
    "three sines, dirt 0.5 %": Setting(),
    "sine, dirt 0.5 %": Setting("sine"),
    "closed loop, dirt 0.5 %": Setting("loop"),
    "three sines, mass unknown": Setting(mass_known=False),
    "three sines, white noise only": Setting(dirt=0.0),
}
FIRST_MACHINE = 800  # seed
NAIVE_SECONDS = 60.0  # of CPU that a naive user's search gets per problem; ours needs a hundredth of a second


class Reached(Exception):  # noqa: N818  (a reason to stop, not an error)
    """The target, or the end of the budget."""


@dataclass
class Objective:
    """Eq. (4) on the unit cube, counting; stops its user at the target."""

    case: Case
    target: float
    best: float = np.inf
    evaluations: int = 0
    raises: bool = True
    problem: object = field(init=False)

    def __post_init__(self) -> None:
        self.problem = self.case.problem()

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        """Criteria of candidates (m, 4) in 0..1. (m,)"""
        friction = self.case.low + np.clip(unit, 0.0, 1.0) * (self.case.high - self.case.low)
        values = criterion(self.problem, to_unknowns(self.problem, friction))
        self.best = min(self.best, float(values.min()))
        self.evaluations += len(unit)
        if self.done and self.raises:
            raise Reached
        return values

    @property
    def done(self) -> bool:
        """Whether the target is reached or the budget spent."""
        return self.best <= self.target or self.evaluations >= BUDGET


def scipy_evolution(objective: Objective, seed: int) -> None:
    """SciPy's differential evolution, vectorised."""
    differential_evolution(
        lambda x: objective(np.atleast_2d(x.T)) if x.ndim == 2 else float(objective(x[None])[0]),
        [(0.0, 1.0)] * 4,
        rng=np.random.default_rng(seed),
        vectorized=True,
        updating="deferred",
        tol=0.0,
        maxiter=10_000,
    )


def cma_es(objective: Objective, seed: int) -> None:
    """CMA-ES of pip's `cma`, with restarts from random points until the budget ends; 16 lanes."""
    cma = importlib.import_module("cma")
    rng = np.random.default_rng(seed)
    while True:
        options = {"bounds": [0, 1], "popsize": 16, "seed": int(rng.integers(1, 2**31)), "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(rng.uniform(0.2, 0.8, 4), 0.25, options)
        while not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, objective(np.array(points)).tolist())


def pymoo_ga(objective: Objective, seed: int) -> None:
    """pymoo's GA, population 50."""
    core = importlib.import_module("pymoo.core.problem")
    algorithm = importlib.import_module("pymoo.algorithms.soo.nonconvex.ga").GA(pop_size=50)
    minimise = importlib.import_module("pymoo.optimize").minimize

    class Cube(core.Problem):
        def _evaluate(self, x: np.ndarray, out: dict, *_: object, **__: object) -> None:
            out["F"] = objective(x)[:, None]

    minimise(Cube(n_var=4, n_obj=1, xl=np.zeros(4), xu=np.ones(4)), algorithm, ("n_eval", BUDGET + 1), seed=seed)


def pygad_ga(objective: Objective, seed: int) -> None:
    """PyGAD, 50 individuals, whole population at once."""
    pygad = importlib.import_module("pygad")
    objective.raises = False  # it logs exceptions; it stops by word instead
    pygad.GA(
        num_generations=10_000,
        num_parents_mating=25,
        fitness_func=lambda _ga, x, _index: (1.0 / objective(np.atleast_2d(x))).tolist(),
        fitness_batch_size=50,
        sol_per_pop=50,
        num_genes=4,
        gene_space={"low": 0.0, "high": 1.0},
        mutation_num_genes=1,
        random_seed=seed,
        on_generation=lambda _ga: "stop" if objective.done else None,
        suppress_warnings=True,
    ).run()


def paper_ga(objective: Objective, seed: int) -> None:
    """The paper's own (§4.4), 8 bits, 50 individuals."""
    settings = GeneticSettings(generations=BUDGET)
    genetic_search(objective, (np.zeros(4), np.ones(4)), settings, np.random.default_rng(seed))


PEERS: dict[str, tuple[str | None, Callable[[Objective, int], None]]] = {
    "paper's GA, 8 bits": (None, paper_ga),
    "SciPy differential_evolution": (None, scipy_evolution),
    "CMA-ES (cma)": ("cma", cma_es),
    "pymoo GA": ("pymoo", pymoo_ga),
    "PyGAD": ("pygad", pygad_ga),
}


@dataclass
class Score:
    """What one searcher did on all problems."""

    solved: list[bool] = field(default_factory=list)
    evaluations: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def row(self, name: str, generation: float) -> str:
        """One line of the table; medians count the solved problems only."""
        share = np.mean(self.solved)
        solved = np.array(self.solved)
        if not solved.any():
            return f"{name:34s} {len(solved):4d} {0:8.1%} {'-':>8s} {'-':>9s} {'-':>9s} {'-':>8s}"
        seconds = np.array(self.seconds)[solved]
        return (
            f"{name:34s} {len(solved):4d} {share:8.1%} {np.median(np.array(self.evaluations)[solved]):8.0f} "
            f"{1e3 * np.median(seconds):9.1f} {1e3 * np.quantile(seconds, 0.95):9.1f} "
            f"{np.median(seconds) / generation:8.1f}"
        )


def generation_seconds() -> tuple[float, str]:
    """CPU time of one generation, 50 candidates x 2000 samples x 2 sub-steps, by the C rival; by ours without gcc."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return min(_cpu_seconds(ours_march) for _ in range(50)), "our compiled kernel (no gcc here)"
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "population.so"
        source = Path(__file__).with_name("population.c")
        subprocess.run([compiler, *FLAGS, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"], check=True)
        march = ctypes.CDLL(str(library)).march
    array = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    march.argtypes = [ctypes.c_long, ctypes.c_long, array, ctypes.c_double, ctypes.c_long, array, array, array, array]
    out = np.empty((N, M))
    times = [
        _cpu_seconds(lambda: march(N, M, FORCE, DT, SUBSTEPS, LAW, np.zeros(M), np.zeros(M), out)) for _ in range(50)
    ]
    return min(times), "C, vectorised"


def _cpu_seconds(function: Callable[[], object]) -> float:
    begin = time.process_time()
    function()
    return time.process_time() - begin


def ours(case: Case, seed: int) -> tuple[float, int, float]:
    """Criterion, evaluations and CPU time of the genetic search and polish on eq. (4)."""
    problem = case.problem()
    begin = time.process_time()
    found = output_error_search(problem, np.random.default_rng(seed))
    seconds = time.process_time() - begin
    return float(criterion(problem, found.x[None])[0]), found.evaluations, seconds


def from_the_truth(case: Case) -> float:
    """Criterion of the optimum nearest to the truth, which nobody but this bench knows."""
    problem = case.problem()
    ends = polish_all(problem, to_unknowns(problem, case.truth[None]), FREE, 60, 1e-4)
    return float(criterion(problem, ends.x)[0])


def search_table(first: int, count: int, peer_count: int) -> None:
    """Print success, evaluations and times of all searchers."""
    generation, whose = generation_seconds()
    scores = {"ours: genetic search and polish": Score(), **{name: Score() for name in PEERS}}
    ours(draw(first), 0)
    for number in range(count):
        case = draw(first + number)
        value, evaluations, seconds = ours(case, number)
        best = min(value, from_the_truth(case))
        mine = scores["ours: genetic search and polish"]
        mine.solved.append(value <= SUCCESS * best)
        mine.evaluations.append(evaluations)
        mine.seconds.append(seconds)
        for name, (module, run) in PEERS.items():
            if number >= peer_count or (module and importlib.util.find_spec(module) is None):
                continue
            objective = Objective(case, SUCCESS * best)
            begin = time.process_time()
            with contextlib.suppress(Reached):
                run(objective, number + 1)
            scores[name].solved.append(objective.best <= objective.target)
            scores[name].evaluations.append(objective.evaluations)
            scores[name].seconds.append(time.process_time() - begin)
    print(f"eq. (4), four unknowns, n = 2000, noise 1e-3 m; one generation here: {1e3 * generation:.2f} ms ({whose})")
    print(f"{'':34s} {'of':>4s} {'solved':>8s} {'evals':>8s} {'ms':>9s} {'ms, 95 %':>9s} {'in gen.':>8s}")
    for name, score in scores.items():
        if score.solved:
            print(score.row(name, generation))
        else:
            print(f"{name:34s} skipped: {PEERS[name][0]} is not installed (make bench-search installs it)")


class OutOfTimeError(Exception):
    """The naive user's patience is at its end."""


def naive_user(first: int, count: int) -> None:
    """Print what solve_ivp, a smoothed sign and differential evolution with its defaults reach in a minute."""
    for number in range(first, first + count):
        case = draw(number)
        values = naive_search(case, number)
        best = min(ours(case, number)[0], from_the_truth(case))
        each = NAIVE_SECONDS / len(values)
        print(
            f"naive solve_ivp + differential_evolution, problem {number}: {len(values)} evaluations of {each:.2f} s in "
            f"{NAIVE_SECONDS:g} s, criterion then {min(values) / best:.3g} times the best; the 3500 that it would need "
            f"are {3500 * each / 60:.0f} min"
        )


def naive_search(case: Case, seed: int) -> list[float]:
    """Criteria of all evaluations until the time is up."""
    recording, mechanics = case.recording, case.axis.mechanics
    begin, values = time.process_time(), []

    def objective(p: np.ndarray) -> float:
        def slope(t: float, state: np.ndarray) -> list[float]:
            v = state[1]
            force = np.interp(t, recording.t, recording.force) - mechanics.weight
            friction = (p[0] + (p[1] - p[0]) * np.exp(-abs(v) / p[2])) * np.tanh(v / 1e-3) + p[3] * v
            return [v, (force - friction) / mechanics.moving_mass]

        end = (float(recording.t[0]), float(recording.t[-1]))
        y = solve_ivp(slope, end, [0.0, 0.0], t_eval=recording.t, max_step=0.01).y[0]
        values.append(float(np.sum((recording.position - y) ** 2) / np.sum(recording.position**2)))
        if time.process_time() - begin > NAIVE_SECONDS:
            raise OutOfTimeError
        return values[-1]

    with contextlib.suppress(OutOfTimeError):
        differential_evolution(objective, list(zip(case.low, case.high, strict=True)), rng=np.random.default_rng(seed))
    return values


def whole_windows(count: int) -> None:
    """Print what a whole window costs: search, intervals, curve, held-out check and verdict."""
    generation, _ = generation_seconds()
    rows: dict[str, list[float]] = {"observer, cold": [], "observer, warm": [], "output error, cold": []}
    for number in range(-1, count):
        case = draw(abs(number))
        for name, times in rows.items():
            criterion_name = "observer" if name.startswith("observer") else "output_error"
            start = None
            if name.endswith("warm"):
                wobble = 1 + 0.03 * np.random.default_rng(abs(number)).normal(size=4)
                names = ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")
                start = dict(zip(names, (case.truth * wobble).tolist(), strict=True))
            begin = time.process_time()
            identify_friction(case.recording, case.axis, seed=abs(number), criterion=criterion_name, start=start)
            if number >= 0:
                times.append(time.process_time() - begin)
    print("whole windows of 2000 samples: seven unknowns, intervals, friction curve, held-out check, verdict")
    for name, times in rows.items():
        print(
            f"{name:34s} {len(times):4d} {1e3 * np.median(times):9.1f} ms, 95 %: "
            f"{1e3 * np.quantile(times, 0.95):.1f} ms = {np.median(times) / generation:.0f} generations"
        )


def following_windows(count: int) -> None:
    """Print what a window costs from nothing, and the one after it from its answer, on machines with unknown forces."""
    generation, _ = generation_seconds()
    print("windows of 2000 samples, noise 0.1 mm: the first from nothing (cold), the next from its answer (warm)")
    for name, setting in WINDOWS.items():
        cold, warm = [], []
        for number in range(-1, count):
            case = draw_case(FIRST_MACHINE + abs(number), dataclasses.replace(setting, samples=2 * N))
            first, second = (_part(case.recording, k * N, (k + 1) * N) for k in (0, 1))
            begin = time.process_time()
            answer = identify_friction(first, case.axis)
            middle = time.process_time()
            start = {name: parameter.value for name, parameter in answer.parameters.items()}
            identify_friction(second, case.axis, start=start)
            if number >= 0:
                cold.append(middle - begin)
                warm.append(time.process_time() - middle)
        cells = (
            f"{1e3 * np.median(x):6.1f} ms, 95 %: {1e3 * np.quantile(x, 0.95):6.1f} ms = "
            f"{np.median(x) / generation:3.0f} generations"
            for x in (cold, warm)
        )
        print(f"{name:34s} {count:4d}  cold {' | warm '.join(cells)}")


def _part(recording: Recording, first: int, last: int) -> Recording:
    """Samples `first` to `last` as a recording of its own."""
    cut = slice(first, last)
    t = recording.t[cut] - recording.t[first]
    return dataclasses.replace(recording, t=t, force=recording.force[cut], position=recording.position[cut])


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", type=int, default=200, help="for ours")
    parser.add_argument("--peers", type=int, default=200, help="for the peers, the first ones of the same problems")
    parser.add_argument("--first", type=int, default=0, help="number of the first problem; others are fresh ones")
    parser.add_argument("--naive", type=int, default=2, help="problems for the naive user, a minute each")
    parser.add_argument("--windows", type=int, default=20, help="machines per row of the last table")
    options = parser.parse_args()
    search_table(options.first, options.problems, options.peers)
    naive_user(options.first, options.naive)
    whole_windows(min(options.problems, 40))
    following_windows(options.windows)


if __name__ == "__main__":
    main()
