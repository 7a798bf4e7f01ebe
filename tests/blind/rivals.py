"""What everybody would try, on the very same cases: `python -m tests.blind.rivals CASE`, JSON of names per method.

- output error + BIC: free runs over the whole recording (no observer), polished by Levenberg-Marquardt, every effect of
  the catalogue added in turn from all its starting points, plain Bayes information criterion, forward, at most two.
- force regression + BIC: position low-passed and differentiated, drive force regressed on inertia, friction and a
  column or two per effect; forward, at most two.
- sparse regression: pysindy's library approach: the same columns, sequentially thresholded least squares, the threshold
  with the best criterion among those that leave at most two names.

Each gets the axis file and the recordings that the diagnosis gets, its preprocessing and its starting points, and gives
sets of names: the best, then those within ten units of its criterion (the usual reading of BIC).
"""

from __future__ import annotations

import itertools
import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from identify.mismatch.data import gather
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.residual import setting_of
from identify.mismatch.ways import guises
from identify.polish import polish_all
from identify.preprocess import Samples
from plant.axis import Axis
from plant.axis_file import read_axis
from plant.effects import find, names
from plant.recording_files import read_recording_entry

Floats = NDArray[np.float64]
Sets = list[list[str]]

FREE = np.zeros(4)
CLOSE = 10.0  # of BIC: "very strong" begins there (Kass & Raftery 1995)
LOOKED_AT = 8  # effects that output error fits in full per step
MOST = 2  # effects
CUT = 10.0  # Hz of the regression's low-pass
SPEEDS = (0.02, 0.05, 0.1, 0.2)  # of the fastest speed: Stribeck speeds tried
SPARSE = tuple(np.geomspace(0.01, 1.0, 13))  # thresholds on columns scaled to the force; BIC picks one
TWINS = {"actuator_lag": "dead_time", "force_offset": "coulomb_asymmetry", "inertia_error": "torque_scale_error"}


def output_error(samples: Samples, axis: Axis) -> Sets:
    """Free-run output error with BIC."""
    problem = ExtendedProblem(samples, axis)
    start = np.zeros((3, problem.size))
    start[:, :4] = [(0.5, 0.65, np.log(0.25), 0.3), (0.4, 0.4, np.log(0.1), 0.4), (0.3, 0.5, np.log(0.5), 0.2)]
    ends = polish_all(problem, start, FREE, 25)
    x, loss = ends.x[ends.best], float(ends.loss[ends.best])
    ways = guises({name: find(name) for name in names()}, setting_of(problem, x))
    price = float(np.log(samples.used))
    found: list[list[tuple[float, list[str]]]] = []
    chosen, best = [], loss + problem.p * price
    for _ in range(MOST):
        looked = []
        for guise in ways:
            if guise.stiff or guise.name in {g.name for g in chosen}:
                continue
            richer = problem.including((*chosen, guise))
            y = _carried(problem, x, richer, guise.scaled_starts())
            losses = richer.losses(y, FREE)
            looked.append((float(losses.min()), richer, y[int(losses.argmin())], guise))
        tried = []
        for _, richer, y, guise in sorted(looked, key=lambda one: one[0])[:LOOKED_AT]:
            end = polish_all(richer, y[None], FREE, 10)
            tried.append((float(end.loss[0]) + richer.p * price, richer, end.x[0], guise))
        top = min(tried, key=lambda one: one[0])
        if not top[0] < best:
            break
        found.append([(cost, [*(g.name for g in chosen), guise.name]) for cost, _, _, guise in tried])
        best, problem, x = top[0], top[1], top[2]
        chosen = [*chosen, top[3]]
    return _sets(found, best)


def _carried(old: ExtendedProblem, x: Floats, new: ExtendedProblem, starts: Floats) -> Floats:
    """Unknowns of `new`, which has one more effect, at x of `old` and the starts (s, q) of that effect."""
    y = np.zeros((len(starts), new.size))
    y[:, : old.base] = x[: old.base]
    for guise in new.guises:
        if guise in old.guises:
            y[:, new.slot(guise)] = x[old.slot(guise)]
        else:
            y[:, new.slot(guise)] = starts
    y[:, new.p :] = x[old.p :]
    return y


def _sets(stages: list[list[tuple[float, list[str]]]], best: float) -> Sets:
    """The best set and all of its stage that are nearly as good."""
    if not stages:
        return []
    last = sorted(stages[-1], key=lambda one: one[0])
    unique: Sets = []
    for cost, one in last:
        if cost < best + CLOSE and sorted(one) not in [sorted(other) for other in unique]:
            unique.append(one)
    return unique


def _columns(samples: Samples, axis: Axis) -> tuple[Floats, Floats, dict[str, list[Floats]]]:
    """Filtered drive force (n,), columns of the baseline (n, k), and columns of each effect (n, q) at its places."""
    rate = 1.0 / samples.sample_time
    sections = butter(4, min(CUT, 0.2 * rate) / (0.5 * rate), output="sos")
    parts = []
    for a, b in itertools.pairwise([*samples.first.tolist(), len(samples)]):
        if b - a > 60:
            y = sosfiltfilt(sections, samples.position[a:b])
            v = np.gradient(y, samples.t[a:b])
            parts.append((samples.t[a:b], samples.force[a:b], y, v, np.gradient(v, samples.t[a:b])))
    t, force, y, v, a = (np.concatenate([part[k] for part in parts]) for k in range(5))
    edges = np.cumsum([0, *(len(part[0]) for part in parts)])
    mechanics = axis.mechanics
    fastest = float(np.quantile(np.abs(v), 0.98))
    s = np.where(np.abs(v) > 0.02 * fastest, np.sign(v), 0.0)
    low, high = float(y.min()), float(y.max())
    middle, travel, rate_of_force = 0.5 * (low + high), high - low, np.gradient(force, samples.sample_time)
    known = mechanics.moving_mass if mechanics.inertia_known else 0.0
    target = force - known * a - mechanics.weight
    base = [s, v, *(s * np.exp(-np.abs(v) / (share * fastest)) for share in SPEEDS)]
    base += [] if known else [a]
    base += [] if mechanics.weight > 0 else [np.ones_like(v)]

    def wave(period: float) -> Floats:
        return np.stack([np.cos(2 * np.pi * y / period), np.sin(2 * np.pi * y / period)], axis=1)

    def one(column: Floats) -> Floats:
        return column[:, None]

    turn = 2 * np.pi * mechanics.Rm
    last = float(t.max())
    effects = {
        "force_offset": [one(np.ones_like(v))],
        "coulomb_asymmetry": [one(np.abs(s))],
        "viscous_asymmetry": [one(np.abs(v))],
        "position_dependent_friction": [one(s * (y - middle))],
        "rail_defect": [one(s * np.exp(-0.5 * ((y - c) / w) ** 2))
                        for w in (0.01 * travel, 0.04 * travel) for c in np.arange(low, high, 1.5 * w)],
        "presliding_hysteresis": [one(_since(s, y, edges, d * travel)) for d in (0.002, 0.01, 0.03)],
        "torque_ripple": [wave(p) for p in (turn, turn / 2, turn / 3, turn / 6) if 1e-3 * travel < p < travel],
        "pulley_eccentricity": [force[:, None] * wave(2 * np.pi * mechanics.Rc)],
        "load_dependent_friction": [one(s * np.abs(force))],
        "thermal_drift": [one(v * np.exp(-t / tau)) for tau in (0.2 * last, 0.5 * last, last)],
        "quadratic_drag": [one(v * np.abs(v))],
        "position_spring": [one(y - middle)],
        "inertia_error": [one(a + mechanics.weight / max(mechanics.M, 1e-9))] if mechanics.weight else [one(a)],
        "torque_scale_error": [one(mechanics.moving_mass * a + mechanics.weight)] if known else [],
        "actuator_lag": [one(rate_of_force)],
        "dead_time": [one(rate_of_force)],
        "torque_saturation": [one(np.sign(force) * np.maximum(np.abs(force) - q * np.abs(force).max(), 0.0))
                              for q in (0.95, 0.85, 0.7)],
        "end_stop": [one(side * np.maximum(side * (y - end), 0.0))
                     for side, edge in ((1.0, high), (-1.0, low))
                     for end in (edge - side * 0.03 * travel, edge - side * 0.1 * travel)],
        "step_change": [one(s * (t > when)) for when in np.linspace(0.1, 0.9, 17) * last],
    }  # fmt: skip
    if not known:
        effects.pop("inertia_error")
    moving = s != 0.0  # where friction has one value

    def through(columns: Floats) -> Floats:
        filtered = np.empty_like(columns)
        for a_, b_ in itertools.pairwise(edges.tolist()):
            filtered[a_:b_] = sosfiltfilt(sections, columns[a_:b_], axis=0)
        return filtered[moving]

    return (
        through(target[:, None])[:, 0],
        through(np.stack(base, axis=1)),
        {name: [through(place) for place in places] for name, places in effects.items()},
    )


def _since(s: Floats, y: Floats, edges: NDArray[np.int64], reach: float) -> Floats:
    """What bristles of length `reach` lack of full friction after a reversal."""
    found, turned, last = np.zeros_like(y), y[0], 0.0
    for k in range(len(y)):
        if k in edges or (s[k] != 0.0 and s[k] != last):
            turned, last = y[k], s[k]
        found[k] = s[k] * np.exp(-abs(y[k] - turned) / reach)
    return found


def _cost(target: Floats, columns: Floats) -> float:
    """N log mean square plus price of the columns."""
    solution, *_ = np.linalg.lstsq(columns, target, rcond=None)
    left = target - columns @ solution
    return len(target) * float(np.log(left @ left / len(target))) + columns.shape[1] * float(np.log(len(target)))


def force_regression(samples: Samples, axis: Axis) -> Sets:
    """Linear regression of the drive force with BIC."""
    target, base, effects = _columns(samples, axis)
    return _regressed(target, base, effects)


def _regressed(target: Floats, base: Floats, effects: dict[str, list[Floats]]) -> Sets:
    chosen: list[str] = []
    best, stages = _cost(target, base), []
    for _ in range(MOST):
        tried = []
        for name in effects.keys() - set(chosen):
            place = min(effects[name], key=lambda one: _cost(target, np.hstack([base, one])), default=None)
            if place is not None:
                tried.append((_cost(target, np.hstack([base, place])), name, place))
        cost, name, place = min(tried, key=lambda one: one[0])
        if not cost < best:
            break
        stages.append([(price, [*chosen, other]) for price, other, _ in tried])
        best, base, chosen = cost, np.hstack([base, place]), [*chosen, name]
    return _sets(stages, best)


def sparse_regression(samples: Samples, axis: Axis) -> Sets:
    """Sequentially thresholded least squares over the library, one column per effect at its best place."""
    import pysindy

    target, base, effects = _columns(samples, axis)
    titles, columns = [], []
    for name, places in effects.items():
        if places and name not in TWINS.values():  # their columns are those of their twins
            place = min(places, key=lambda one: _cost(target, np.hstack([base, one])))
            titles += [name] * place.shape[1]
            columns.append(place)
    library = np.hstack([base, *columns])
    size = np.linalg.norm(library, axis=0) / np.linalg.norm(target) + 1e-300
    best, said = float("inf"), list[str]()
    for threshold in SPARSE:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a threshold that leaves nothing is one of the answers
            fitted = pysindy.STLSQ(threshold=threshold, alpha=1e-6).fit(library / size, target[:, None])
        active = np.abs(np.ravel(fitted.coef_)) > 0
        active[: base.shape[1]] = True
        named = sorted({title for title, on in zip(titles, active[base.shape[1] :], strict=True) if on})
        cost = _cost(target, library[:, active])
        if cost < best and len(named) <= MOST:
            best, said = cost, named
    sets = [said] if said else []
    for name, twin in TWINS.items():
        sets += [[twin if one == name else one for one in said]] if name in said else []
    return sets


METHODS: dict[str, Callable[[Samples, Axis], Sets]] = {
    "output error + BIC": output_error,
    "force regression + BIC": force_regression,
    "sparse regression": sparse_regression,
}


def answers(folder: Path) -> dict[str, dict]:
    """Sets of names by each method for a case folder, with seconds; an error in words where one failed."""
    axis = read_axis(folder / "axis.toml")
    samples = gather([read_recording_entry(entry, axis) for entry in axis.recordings], axis).train
    found = {}
    for method, solve in METHODS.items():
        clock = time.perf_counter()
        try:
            found[method] = {"sets": solve(samples, axis)}
        except (ImportError, ValueError, np.linalg.LinAlgError) as error:
            found[method] = {"sets": None, "error": f"{type(error).__name__}: {error}"}
        found[method]["seconds"] = round(time.perf_counter() - clock, 3)
    return found


if __name__ == "__main__":
    print(json.dumps(answers(Path(sys.argv[1]))))
