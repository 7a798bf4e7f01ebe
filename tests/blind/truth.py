"""What the true machine itself would predict of the held-out recording: the yardstick of severity.

The reference simulator runs the true machine for one second at a time from states smoothed here, driven by the force as
it was recorded; squared errors over the squares of the centred position, as in the contract's criterion. What does not
repeat (dirt, roughness, noise) is in it, so it is what a perfect answer can reach. How well one effect of a pair shows
is how much worse the same machine predicts without it, after all that may stand in for it was fitted anew. Shares no
code with the fit.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from tests.reference.cases import HELPERS, Case
from tests.reference.excitation import Torque
from tests.reference.machine import run
from tests.reference.parameters import ReferencePlant

RUN_LENGTH = 1.0  # s
REACHES = (0.02, 0.03, 0.05, 0.08, 0.12, 0.18)  # s to each side of a smoothed state; the widest that fits is taken
FITS = 1.25  # times the sensor's noise: residual of a parabola that fits
HELD_OUT = 0.4  # of the last recording, where it has no second one of its state
FINE = 1e-3  # s: grid of the force
STEP = 2e-4  # s of the automaton: 0.1 um, far below any noise here
GAP = 1.5  # periods: a run must not cross a longer step
SHOWS = 1.3  # ratio of criteria below which nothing needs to be fitted anew: an effect is hidden already
ROOM = 5.0  # times: how far a number that stands in for an effect may go
TRIES = 4  # steps of a fit, each with its slope


def criterion(case: Case) -> float:
    """Eq. (4) of the true machine over one-second runs on the held-out samples. [1]"""
    errors = _errors(case, case.plant)
    return float(errors @ errors)


def beside(case: Case) -> dict[str, float]:
    """How well each effect of `case` shows beside the others: criterion without it over the true machine's. [1]

    What is free in the baseline, and all numbers of the other effects, are fitted to the held-out samples without it.
    """
    own = criterion(case)
    return {name: without(case, name, SHOWS * own) / own for name in case.plant.effects}


def without(case: Case, name: str, enough: float) -> float:
    """Least criterion of a machine that lacks one effect, inf where there is none; nothing is fitted below `enough`."""
    plant, axis = case.plant, case.axis["mechanics"]
    others = {other: values for other, values in plant.effects.items() if other != name}
    shapes = {other: shape for other, shape in plant.shapes.items() if other != name}
    bare = replace(plant, effects=others, shapes=shapes)
    numbers = [(other, key) for other, values in others.items() for key in values if key not in HELPERS]
    known = axis.get("inertia_known", True)
    constant = "force_offset" not in others and not (known and axis.get("axis", "vertical") == "vertical")

    def machine(x: np.ndarray) -> ReferencePlant:
        level, bump, bend, viscous, mass, push, *factors = x
        effects = {other: dict(values) for other, values in others.items()}
        for (other, key), times in zip(numbers, factors, strict=True):
            effects[other][key] *= times
        if constant:
            effects["force_offset"] = {"force": push * plant.coulomb_force}
        coulomb = level * plant.coulomb_force
        return replace(
            bare, M=plant.M * (1.0 if known else mass), coulomb_force=coulomb,
            static_force=coulomb + bump * (plant.static_force - plant.coulomb_force),
            stribeck_velocity=bend * plant.stribeck_velocity, viscous_coefficient=viscous * plant.viscous_coefficient,
            effects=effects,
        )  # fmt: skip

    start = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0, *(1.0 for _ in numbers)])
    low, high = np.full(len(start), 1.0 / ROOM), np.full(len(start), ROOM)
    low[5], high[5] = -ROOM, ROOM

    def errors(x: np.ndarray) -> np.ndarray:
        return _errors(case, machine(x))

    try:
        first = errors(start)
    except ValueError:  # the parameters of no machine: all its mass was the error of it
        return math.inf
    if first @ first < enough:
        return float(first @ first)
    found = least_squares(errors, start, bounds=(low, high), diff_step=0.01, max_nfev=TRIES)
    return float(2.0 * found.cost)


def _errors(case: Case, plant: ReferencePlant) -> np.ndarray:
    """Errors of one-second runs of `plant` on the held-out samples, over the root of the sum of squares. [1] (n,)"""
    entry = case.recordings[-1]
    t, force, position = (np.asarray(entry["columns"][name]) for name in ("t", "force", "position"))
    held = entry["loop"] == "open" or entry["torque"].startswith("mean") or case.spec.period <= FINE
    fine = np.arange(t[0], t[-1] + FINE, FINE)
    plant, driven = _without_memory(plant, fine, t, force, held)
    stiff = {"presliding_hysteresis", "backlash", "transmission_compliance"} & set(plant.effects)
    first = 0 if case.spec.recordings > 1 else round((1.0 - HELD_OUT) * len(t))
    mean = float(position[first:].mean())
    noise = _noise(position)
    pieces, errors = _pieces(t, first), []
    for a, b in pieces:
        y, v = _state(t, position, a, first, noise)
        own = slice(int(np.searchsorted(fine, t[a])), int(np.searchsorted(fine, t[b - 1])) + 2)
        stamps = np.concatenate([[t[a]], fine[own][fine[own] > t[a]]])
        forces = np.concatenate([driven[own][:1], driven[own][fine[own] > t[a]]])
        moved = run(plant, Torque(stamps, forces / plant.gain), position0=y, velocity0=v, settled=True,
                    step=5e-5 if stiff else STEP)  # fmt: skip
        predicted = np.interp(t[a:b], stamps, moved["position"])
        errors.append(np.nan_to_num(position[a:b] - predicted, nan=mean))
    held_out = np.concatenate([position[a:b] for a, b in pieces])
    return np.concatenate(errors) / max(float(np.linalg.norm(held_out - mean)), 1e-150)


def _noise(position: np.ndarray) -> float:
    """Standard deviation of white noise, from differences of the third order. [m]"""
    third = np.diff(position, 3)
    return float(np.sqrt(np.median(third**2) / 0.4549 / 20.0))


def _pieces(t: np.ndarray, first: int) -> list[tuple[int, int]]:
    """Runs of a second from sample `first` on, none across lost samples."""
    period = float(np.median(np.diff(t)))
    piece = np.floor((t - t[first]) / RUN_LENGTH + 1e-9).astype(int)
    fresh = (np.diff(piece, prepend=piece[0] - 1) != 0) | (np.diff(t, prepend=t[0]) > GAP * period)
    edges = [*(first + np.flatnonzero(fresh[first:])).tolist(), len(t)]
    if edges[0] != first:
        edges = [first, *edges]
    return [(a, b) for a, b in itertools.pairwise(edges) if b - a >= 5]


def _state(t: np.ndarray, position: np.ndarray, at: int, first: int, noise: float) -> tuple[float, float]:
    """Position and velocity at sample `at` by the widest parabola that fits the samples around it to their noise."""
    best = (float(position[at]), 0.0)
    for reach in REACHES:
        near = np.flatnonzero(np.abs(t - t[at]) <= reach)
        near = near[near >= first]
        if len(near) < 4:
            continue
        u = t[near] - t[at]
        fitted = np.polynomial.polynomial.polyfit(u, position[near], 2)
        left = position[near] - np.polynomial.polynomial.polyval(u, fitted)
        if best[1] != 0.0 and np.sqrt(left @ left / max(len(near) - 3, 1)) > FITS * noise:
            break
        best = float(fitted[0]), float(fitted[1])
    return best


def _without_memory(
    plant: ReferencePlant, fine: np.ndarray, t: np.ndarray, force: np.ndarray, held: bool
) -> tuple[ReferencePlant, np.ndarray]:
    """The machine without delay and lag, and the force on the fine grid that has passed them: a run that is restarted
    would forget what was under way."""
    effects = {name: dict(values) for name, values in plant.effects.items()}
    late = fine - effects.pop("dead_time", {"delay": 0.0})["delay"]
    if held:
        driven = force[np.clip(np.searchsorted(t, late + 1e-9, side="right") - 1, 0, len(t) - 1)]
    else:
        driven = np.interp(late, t, force)
    if "actuator_lag" in effects:
        orders = 2 if "actuator_lag" in plant.shapes else 1
        keep = float(np.exp(-FINE / (effects.pop("actuator_lag")["time_constant"] / orders)))
        for _ in range(orders):
            driven = lfilter([1.0 - keep], [1.0, -keep], driven, zi=[keep * driven[0]])[0]
    shapes = {name: shape for name, shape in plant.shapes.items() if name in effects}
    return replace(plant, effects=effects, shapes=shapes), driven
