"""The last polish: in fine steps where the model asks for them, at the observer that makes it predict best.

The search marches springs, gaps and bristles in steps too long for them; one-step errors forgive most of that, the
answer does not. And the likeliest observer explains the noise of the torque and of the clock as force; so strong a one
forgives parameters that one-second free runs do not. A weaker one is nearer the truth where those runs fall clearly on
the fitted data, are no worse on unseen data, and no effect comes to nothing.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from identify.mismatch.clock import clock
from identify.mismatch.compare import Fit, free_run_ratio
from identify.mismatch.extended import ExtendedProblem
from identify.mismatch.rules import at_edge
from identify.mismatch.score import extend
from identify.observer import gain_table
from identify.polish import polish_all
from identify.preprocess import Samples
from identify.search import CLASSICAL, ROUGH, SearchResult, losses_by_gain

Floats = NDArray[np.float64]

FINE = 40  # sub-steps of a sample at most, for springs, gaps and bristles
ASIDE = 0.7  # of a logarithmic unknown: a factor of two from where the coarse steps led
STEPS = (1, 2, 3, 4)  # half decades below the likeliest strength of the observer
BETTER = 0.7  # eq. (4) over one-second runs of the fitted data must fall at least to this share
APART = 10.0  # of the loss: by so much likelier clocks apart must be than clocks that agree, about ln n
ITERATIONS = 15


def finished(fitted: Fit, unseen: Samples, period: float) -> Fit:
    """`fitted`, in the steps it needs, and under a weaker observer where that predicts a second ahead better.

    Args:
        fitted: where the search of the model ended.
        unseen: data that nothing was fitted to.
        period: of the recording before averaging, whose clocks may be apart. [s]
    """
    stiff = any(guise.stiff for guise in fitted.problem.guises)
    if stiff:
        fitted = _in_fine_steps(fitted)
    fitted = _with_clocks(fitted, period)
    problem = fitted.problem
    gains, settings = gain_table(problem.samples.sample_time)
    tau, rho = fitted.found.setting
    same = np.flatnonzero((settings[0] == tau) & (settings[1] < 0.99 * rho))[::-1]
    weaker = same[[step - 1 for step in STEPS if step <= len(same)]]
    if not len(weaker):
        return fitted
    count = len(weaker)
    points = np.repeat(np.stack([fitted.x, _classical(fitted.x)]), count, axis=0)
    if stiff:  # dear, and started from there already
        points = points[:count]
    index = np.resize(weaker, len(points))
    clocks = problem.slot(problem.guise("clock")).start  # what a strong observer could not tell, a weak one cannot
    ends = polish_all(problem, points, gains[:, index], ITERATIONS, pinned=clocks)
    best, least = fitted, BETTER
    for k in range(count):
        own = k + count * int(np.argmin(ends.loss[k::count]))
        found = dataclasses.replace(
            fitted.found,
            x=ends.x[own],
            criterion=float(ends.loss[own]),
            gain=gains[:, index[own]].copy(),
            setting=settings[:, index[own]].copy(),
        )
        candidate = Fit(problem, found)
        ratio = free_run_ratio(fitted, candidate)
        if ratio < least and not lost(fitted, candidate) and free_run_ratio(fitted, candidate, unseen) <= 1.0:
            best, least = candidate, ratio
    return best


def clocks_apart(fitted: Fit) -> float:
    """By how much the clocks of a finished fit are apart; what it says of the time of anything may be that. [s]"""
    clock = fitted.problem.guise("clock")
    return abs(clock.value(fitted.x[fitted.problem.slot(clock)], "shift"))


def lost(before: Fit, after: Fit) -> bool:
    """Whether an effect ended on a bound on which it was not."""
    named = [guise for guise in after.problem.guises if guise.name != "clock"]
    return any(at_edge(after, guise) and not at_edge(before, guise) for guise in named)


def _in_fine_steps(coarse: Fit) -> Fit:
    """A model with springs, gaps or bristles fitted again, from where long steps led and from around it."""
    problem = coarse.problem.marched(FINE)
    starts = [coarse.x]
    for guise in problem.guises:
        if guise.stiff and guise.unknowns[0].log:
            for step in (-ASIDE, ASIDE):
                starts.append(coarse.x.copy())
                starts[-1][problem.slot(guise).start] += step
    starts.append(_classical(coarse.x))
    return _settled(problem, np.array(starts), coarse.found)


def _with_clocks(fitted: Fit, period: float) -> Fit:
    """The same with clocks that may be apart; they agree unless the data say otherwise, but nobody knows for sure."""
    way = clock(period, held=not fitted.problem.samples.linear)
    problem, x = extend(fitted, way, np.array([[0.0]]))
    apart = _settled(problem, np.stack([x[0], _classical(x[0])]), fitted.found)
    if apart.found.criterion < fitted.found.criterion - APART:
        return apart
    return Fit(problem, dataclasses.replace(fitted.found, x=x[0]))


def _settled(problem: ExtendedProblem, points: Floats, found: SearchResult) -> Fit:
    """The best of points (k, size), polished at the gain of `found`, then at its own likeliest one."""
    gains, settings = gain_table(problem.samples.sample_time)
    ends = polish_all(problem, np.clip(points, *problem.bounds), found.gain, ITERATIONS, ROUGH)
    index = int(losses_by_gain(problem, ends.x[[ends.best]], gains).argmin())
    last = polish_all(problem, ends.x[[ends.best]], gains[:, index], ITERATIONS)
    setting = settings[:, index].copy()
    return Fit(
        problem,
        dataclasses.replace(
            found, x=last.x[0], criterion=float(last.loss[0]), gain=gains[:, index].copy(), setting=setting
        ),
    )


def _classical(x: Floats) -> Floats:
    """Unknowns x (size,) with a textbook friction."""
    other = x.copy()
    other[: len(CLASSICAL)] = CLASSICAL
    return other
