"""How soon is a change found? Steps and ramps of dry and viscous friction at the default setting. `make delay`.

Beside the watch: the CUSUM that knows the size of the change, the scatter, and the temperature's effect (optimal for
independent deviates, Moustakides 1986); a fixed threshold on one window; river's Page-Hinkley and ADWIN; ruptures'
PELT, run again at every window. All of them see friction at one speed, the temperature's true effect taken out; their
thresholds are set on other healthy axes to ONE false alarm a year, which is more than the watch makes.
"""

from __future__ import annotations

import argparse
import collections
import dataclasses
import warnings
from collections.abc import Callable

import numpy as np

from monitor.drift import DriftRule, DriftState, judge
from tests.monitor.studies.axis_years import WEIGHT
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import Axis, Pool, estimates

HEALTHY, AFTER = 100, 120  # windows, two a day
RAMP_DAYS = 30.0
SIZES = (0.05, 0.1, 0.2, 0.5)
PER_YEAR = 730.5
Detector = Callable[[np.ndarray, float, float], int]  # deviations, size of the change, bar -> windows to the alarm


def cusum(z: np.ndarray, size: float, bar: float) -> int:
    """Known change: size in scatters."""
    total = 0.0
    for n, one in enumerate(z, 1):
        total = max(0.0, total + one - size / 2)
        if total * size > bar:
            return n
    return len(z) + 1


def threshold(z: np.ndarray, _size: float, bar: float) -> int:
    return int(np.argmax(np.abs(z) > bar)) + 1 if (np.abs(z) > bar).any() else len(z) + 1


def page_hinkley(z: np.ndarray, _size: float, bar: float) -> int:
    from river.drift import PageHinkley

    one = PageHinkley(min_instances=1, delta=0.5, threshold=bar, alpha=1.0, mode="both")
    return _river(one, z)


def adwin(z: np.ndarray, _size: float, bar: float) -> int:
    from river.drift import ADWIN

    return _river(ADWIN(delta=float(np.exp(-bar)), clock=1, min_window_length=2, grace_period=2), z)


def _river(detector, z: np.ndarray) -> int:
    for one in np.random.default_rng(0).standard_normal(100):  # the healthy windows it knows
        detector.update(float(one))
    for n, one in enumerate(z, 1):
        detector.update(float(one))
        if detector.drift_detected:
            return n
    return len(z) + 1


def pelt(z: np.ndarray, _size: float, bar: float) -> int:
    import ruptures

    known = np.concatenate([np.random.default_rng(0).standard_normal(40), z])
    for n in range(1, len(z) + 1):
        part = known[max(0, n - 20) : 40 + n]
        if len(ruptures.Pelt(model="l2", min_size=1, jump=1).fit_predict(part, pen=bar)) > 1:
            return n
    return len(z) + 1


RIVALS: dict[str, Detector] = {
    "CUSUM, change known": cusum, "fixed threshold": threshold, "river PageHinkley": page_hinkley,
    "river ADWIN": adwin, "ruptures PELT": pelt,
}  # fmt: skip


def bar_of(detector: Detector, size: float, healthy: np.ndarray) -> float:
    """Bar at which healthy deviations raise one alarm a year; starting anew after each."""
    low, high = 0.0, 60.0
    for _ in range(8):
        middle, count, at = (low + high) / 2, 0, 0
        while at < len(healthy):
            at += detector(healthy[at : at + 400], size, middle) if at + 400 < len(healthy) else len(healthy)
            count += at < len(healthy)
        low, high = (middle, high) if count / (len(healthy) / PER_YEAR) > 1.0 else (low, middle)
    return high


def middle(axis: Axis, found: list) -> np.ndarray:
    """Friction at one speed, with the temperature's true effect taken out, in scatters of the healthy windows."""
    speed = 0.2
    values, expected = [], []
    for one in found:
        at = one.curve.at((speed,))
        values.append(float(at[0][0]) if at else np.nan)
        thickness = float(np.exp(-0.025 * (one.conditions["temperature"] - 21)))
        law = dataclasses.replace(
            axis.law, stribeck_velocity=axis.law.stribeck_velocity / thickness,
            viscous_coefficient=axis.law.viscous_coefficient * thickness,
        )  # fmt: skip
        expected.append(float(law.force(np.array([speed]))[0]))
    relative = np.array(values) / np.array(expected) - 1
    usual = relative[:HEALTHY]
    return np.nan_to_num((relative - usual.mean()) / usual.std(ddof=1))


def watched(found: list, axis: Axis) -> int:
    """Windows to the watch's first finding after the change; a false one before it does not count."""
    weight = 0.0 if FAMILIES[axis.family].horizontal else WEIGHT
    state, rule = DriftState(), DriftRule(weight=weight)
    for n, one in enumerate(found):
        state, findings = judge(state, one, rule)
        if n >= HEALTHY and any(finding.holds for finding in findings):
            return n + 1 - HEALTHY
    return len(found) - HEALTHY + 1


def main(axes: int) -> None:
    warnings.simplefilter("ignore")
    pool = Pool()
    begin = HEALTHY / 2.0
    kinds = {"dry": ("coulomb", "static"), "viscous": ("viscous",)}
    healthy = []
    for seed in range(900, 900 + 12):
        axis = Axis(seed % len(FAMILIES), seed)
        healthy.append(middle(axis, list(estimates(axis, pool, HEALTHY + 365)))[HEALTHY:])
    series = np.concatenate(healthy)
    print(
        f"{axes} axes, scatter {Axis(0, 0).scatter:.1%}, two windows a day; rivals at one false alarm a year",
        flush=True,
    )
    bars = {name: bar_of(detector, 1.0, series) for name, detector in RIVALS.items() if name != "CUSUM, change known"}
    for what, names in kinds.items():
        for shape in ("step", "ramp"):
            for size in SIZES:
                delays = collections.defaultdict(list)
                for seed in range(axes):
                    axis = Axis(seed % len(FAMILIES), seed)

                    def change(day: float, names=names, shape=shape, size=size) -> dict[str, float]:
                        part = 1.0 if shape == "step" else min((day - begin) / RAMP_DAYS, 1.0)
                        return dict.fromkeys(names, 1 + size * part) if day >= begin else {}

                    found = list(estimates(axis, pool, HEALTHY + AFTER, change))
                    delays["watch"].append(watched(found, axis))
                    z = middle(axis, found)[HEALTHY:]
                    shift = max(float(np.median(z[-60:])), 0.5)
                    for name, detector in RIVALS.items():
                        known = name == "CUSUM, change known"
                        bar = bar_of_known(round(shift * 2) / 2, series) if known else bars[name]
                        delays[name].append(detector(z, round(shift * 2) / 2, bar))
                told = ", ".join(f"{name} {np.mean(each):.1f}" for name, each in delays.items())
                ratio = np.mean(delays["watch"]) / np.mean(delays["CUSUM, change known"])
                print(f"{what} {shape} {size:+.0%}: mean windows {told}; watch/optimum {ratio:.2f}", flush=True)


_KNOWN: dict[float, float] = {}


def bar_of_known(size: float, series: np.ndarray) -> float:
    if size not in _KNOWN:
        _KNOWN[size] = bar_of(cusum, size, series)
    return _KNOWN[size]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=60)
    main(parser.parse_args().axes)
