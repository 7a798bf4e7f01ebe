"""How soon is a change found? Steps and ramps of dry and viscous friction at the default setting. `make delay`.

Beside the watch: the CUSUM that knows the size and shape of the change, the level, scatter and correlation of friction
at five speeds, and the temperature's effect (optimal for independent deviates, Moustakides 1986): nobody can be sooner;
the likelihood ratio that knows the same but not what will change (dry, viscous, up, down, how much): what anybody can
hope for who is not told; the CUSUM on one number; a fixed threshold on one window; river's Page-Hinkley and ADWIN;
ruptures' PELT, run again at every window. Those with one number get the speed at which the change stands out most. All
bars are set on other healthy axes of the same kinds to the same rate of first false alarms: the setting, and what the
watch itself makes.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
import warnings

import numpy as np

from monitor.drift import DriftRule, DriftState, judge
from tests.monitor.studies import rivals
from tests.monitor.studies.axis_years import interval
from tests.monitor.studies.pool import FAMILIES
from tests.monitor.studies.synthetic import WEIGHT, Axis, Life, Pool

HEALTHY, AFTER, YEAR = rivals.KNOWN, 120, 730  # windows, two a day
RAMP_DAYS = 30.0
SIZES = (0.05, 0.1, 0.2, 0.5)
PER_YEAR = 730.5
KINDS = {"dry": ("coulomb", "static"), "viscous": ("viscous",)}
JUDGING = 30_000  # first seed of the axes that set the bars; those with a change follow a thousand later


def rule_of(axis: Axis) -> DriftRule:
    return DriftRule(weight=0.0 if FAMILIES[axis.family].horizontal else WEIGHT)


def law_at(axis: Axis, temperature: float, factors: dict[str, float]):
    """True friction law."""
    thin = float(np.exp(-0.025 * (temperature - 21)))
    law = axis.law
    return dataclasses.replace(
        law, coulomb_force=law.coulomb_force * factors.get("coulomb", 1.0),
        static_force=law.static_force * factors.get("static", 1.0), stribeck_velocity=law.stribeck_velocity / thin,
        viscous_coefficient=law.viscous_coefficient * thin * factors.get("viscous", 1.0),
    )  # fmt: skip


def relative(axis: Axis, one, speeds: tuple[float, ...]) -> np.ndarray:
    """Friction over its true healthy value at this temperature, less one; 0 where the window does not tell."""
    at = one.curve.at(speeds)
    if at is None:
        return np.zeros(len(speeds))
    return at[0] / law_at(axis, one.conditions["temperature"], {}).force(np.array(speeds)) - 1


class Healthy:
    """Axes without a change: what every detector does there sets its bar."""

    def __init__(self, axes: int, first: int, pool: Pool) -> None:
        self.speeds: dict[int, tuple[float, ...]] = {}
        self.family = np.array([seed % len(FAMILIES) for seed in range(axes)])
        self.deviations, found = [], []
        for seed in range(first, first + axes):
            axis = Axis((seed - first) % len(FAMILIES), seed)
            life, state, alarm = Life(axis, pool, HEALTHY + YEAR), DriftState(), YEAR + 1
            seen = [life[k] for k in range(HEALTHY + YEAR)]
            for k, one in enumerate(seen):
                state, findings = judge(state, one, rule_of(axis))
                if k >= HEALTHY and any(finding.holds for finding in findings):
                    alarm = min(alarm, k + 1 - HEALTHY)
                    break
            assert state.baseline is not None
            speeds = self.speeds.setdefault(axis.family, state.baseline.speeds)
            self.deviations.append([relative(axis, one, speeds) for one in seen])
            found.append(alarm)
        self.watch = np.array(found)
        deviations = np.array(self.deviations)
        self.mean = {f: deviations[self.family == f].mean(axis=(0, 1)) for f in self.speeds}
        self.spread = {f: np.cov(deviations[self.family == f].reshape(-1, 5).T) for f in self.speeds}
        self.all = deviations

    def shift(self, family: int, factors: dict[str, float]) -> np.ndarray:
        """Relative change of friction at the five speeds."""
        axis, speeds = Axis(family, 0), np.array(self.speeds[family])
        return law_at(axis, 21.0, factors).force(speeds) / law_at(axis, 21.0, {}).force(speeds) - 1

    def known(self, family: int, deviations: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, float]:
        """Deviates of unit variance along a known change, and its size."""
        weight = np.linalg.solve(self.spread[family], shift)
        size = float(np.sqrt(shift @ weight))
        return (deviations - self.mean[family]) @ weight / size, size

    def unknown(self, family: int, deviations: np.ndarray) -> np.ndarray:
        """Deviates of unit covariance in the plane of dry and viscous changes. (windows, 2)"""
        shapes = np.stack([self.shift(family, dict.fromkeys(names, 1.05)) for names in KINDS.values()], axis=1)
        weight = np.linalg.solve(self.spread[family], shapes)
        root = np.linalg.cholesky(np.linalg.inv(shapes.T @ weight))
        return (deviations - self.mean[family]) @ weight @ root

    def best(self, family: int, shift: np.ndarray) -> int:
        """The one speed at which a change stands out most."""
        return int(np.argmax(np.abs(shift) / np.sqrt(np.diag(self.spread[family]))))


def one_number(deviations: np.ndarray, index: int) -> np.ndarray:
    """Friction at one speed in scatters of the first windows, all of which are healthy."""
    usual = deviations[:HEALTHY, index]
    return (deviations[:, index] - usual.mean()) / usual.std(ddof=1)


class Changed:
    """Axes that run healthily and then change, each in every way."""

    def __init__(self, axes: int, first: int, pool: Pool, *, tells: bool = True) -> None:
        self.lives, self.states, self.before = [], [], []
        for seed in range(first, first + axes):
            axis = Axis(seed % len(FAMILIES), seed, tells=tells)
            life, state, findings = Life(axis, pool, HEALTHY + AFTER), DriftState(), []
            for k in range(HEALTHY):
                state, findings = judge(state, life[k], rule_of(axis))
            if not any(finding.holds for finding in findings):
                self.lives.append(life)
                self.states.append(state)

    def usual(self, healthy: Healthy) -> list:
        """Deviations before the change."""
        if not self.before:
            for life in self.lives:
                speeds = healthy.speeds[life.axis.family]
                self.before.append([relative(life.axis, life[k], speeds) for k in range(HEALTHY)])
        return self.before

    def run(self, names: tuple[str, ...], shape: str, size: float):
        """Windows to the watch's first finding, and the deviations (axes, windows, 5) every other detector sees."""
        begin, delays, seen = HEALTHY / 2.0, [], []
        for life, before in zip(self.lives, self.states, strict=True):
            found, state = [], before
            for k in range(HEALTHY, HEALTHY + AFTER):
                part = 1.0 if shape == "step" else min((life.day[k] + 0.5 - begin) / RAMP_DAYS, 1.0)
                found.append(life.at(k, dict.fromkeys(names, 1 + size * part)))
            delay = AFTER + 1
            for n, one in enumerate(found, 1):
                state, findings = judge(state, one, rule_of(life.axis))
                if any(finding.holds for finding in findings):
                    delay = n
                    break
            delays.append(delay)
            seen.append(found)
        return np.array(delays), seen


def compare(healthy: Healthy, changed: Changed, wanted: float, tries: int, few: int) -> None:
    """The table at one rate of false alarms. [1/a]"""
    numbers = {index: np.array([one_number(one, index) for one in healthy.all]) for index in range(5)}
    middle = numbers[2]
    z, known = middle[:, HEALTHY:], middle[:, :HEALTHY]
    bars = {"fixed threshold": rivals.bar_of(np.abs(z), wanted, PER_YEAR)}
    some = slice(0, few)
    bars["ruptures PELT"] = rivals.bar_of(
        np.array([rivals.penalty(*one) for one in zip(z[some], known[some], strict=True)]), wanted, PER_YEAR
    )
    for name, detector in (("river PageHinkley", rivals.page_hinkley), ("river ADWIN", rivals.adwin)):
        bars[name] = rivals.bar_by_trial(detector, z[some], known[some], wanted, PER_YEAR, tries)
    print(f"--- bars for {wanted:.2f} first false alarms a year: { ({k: round(v, 2) for k, v in bars.items()}) }")
    for (what, shape, size), delays, deviations in _cases(healthy, changed):
        names = KINDS[what]
        factors = dict.fromkeys(names, 1 + size)
        shifts = {f: healthy.shift(f, factors) for f in healthy.speeds}
        told = {"watch": delays.astype(float)}
        lives = [(life.axis.family, dev) for life, dev in zip(changed.lives, deviations, strict=True)]
        known_sizes = (1.0,) if shape == "step" else (0.25, 0.5, 1.0)  # for a ramp the best of three is taken
        told["optimum"] = min(
            (_optimum(healthy, lives, {f: part * s for f, s in shifts.items()}, wanted) for part in known_sizes),
            key=lambda found: float(found.mean()),
        )
        told["optimum, change unknown"] = _unknown(healthy, lives, wanted)
        best = {f: healthy.best(f, s) for f, s in shifts.items()}
        told["optimum of one number"] = min(
            (_one(healthy, lives, best, {f: part * s for f, s in shifts.items()}, wanted) for part in known_sizes),
            key=lambda found: float(found.mean()),
        )
        single = [one_number(dev, best[f]) for f, dev in lives]
        after, before = np.array([one[HEALTHY:] for one in single]), np.array([one[:HEALTHY] for one in single])
        told["fixed threshold"] = rivals.first(np.abs(after), bars["fixed threshold"])
        statistic = np.array([rivals.penalty(*one) for one in zip(after[some], before[some], strict=True)])
        told["ruptures PELT"] = rivals.first(statistic, bars["ruptures PELT"])
        for name, detector in (("river PageHinkley", rivals.page_hinkley), ("river ADWIN", rivals.adwin)):
            told[name] = np.array([detector(*one, bars[name]) for one in zip(after, before, strict=True)])
        words = ", ".join(f"{name} {np.mean(each):.2f}" for name, each in told.items())
        ratio = np.mean(told["watch"]) / np.mean(told["optimum"])
        missed = float(np.mean(told["watch"] > AFTER))
        print(f"{what} {shape} {size:+.0%}: {words}; watch/optimum {ratio:.2f}, missed {missed:.0%}", flush=True)


_RUN: dict = {}


def _cases(healthy: Healthy, changed: Changed):
    """Every case, judged and reduced once for all rates: (kind, shape, size), delays of the watch, deviations."""
    for what, names in KINDS.items():
        for shape in ("step", "ramp"):
            for size in SIZES:
                if (what, shape, size) not in _RUN:
                    delays, seen = changed.run(names, shape, size)
                    deviations = []
                    for life, usual, found in zip(changed.lives, changed.usual(healthy), seen, strict=True):
                        speeds = healthy.speeds[life.axis.family]
                        deviations.append(np.array(usual + [relative(life.axis, one, speeds) for one in found]))
                    _RUN[what, shape, size] = delays, deviations
                yield (what, shape, size), *_RUN[what, shape, size]


def _optimum(healthy: Healthy, lives: list, shifts: dict, wanted: float) -> np.ndarray:
    """Delays of the CUSUM that knows everything."""
    quiet = [healthy.known(f, dev, shifts[f]) for f, dev in zip(healthy.family, healthy.all, strict=True)]
    return _delays(quiet, [healthy.known(f, dev, shifts[f]) for f, dev in lives], wanted)


def _unknown(healthy: Healthy, lives: list, wanted: float) -> np.ndarray:
    """Delays of the likelihood ratio that knows the same, but neither size nor direction of the change."""
    quiet = [healthy.unknown(f, dev)[HEALTHY:] for f, dev in zip(healthy.family, healthy.all, strict=True)]
    bar = rivals.bar_of(rivals.glr(np.array(quiet)), wanted, PER_YEAR)
    after = np.array([healthy.unknown(f, dev)[HEALTHY:] for f, dev in lives])
    return rivals.first(rivals.glr(after), bar)


def _one(healthy: Healthy, lives: list, best: dict, shifts: dict, wanted: float) -> np.ndarray:
    """Delays of the CUSUM that knows the change of one number, but learned its level and scatter."""

    def of(family: int, deviations: np.ndarray) -> tuple[np.ndarray, float]:
        index = best[family]
        size = float(shifts[family][index] / np.sqrt(healthy.spread[family][index, index]))
        return one_number(deviations, index), size

    quiet = [of(f, dev) for f, dev in zip(healthy.family, healthy.all, strict=True)]
    return _delays(quiet, [of(f, dev) for f, dev in lives], wanted)


def _delays(quiet: list, changed: list, wanted: float) -> np.ndarray:
    z, size = np.array([one[0] for one in quiet]), np.array([one[1] for one in quiet])
    bar = rivals.bar_of(rivals.cusum(z[:, HEALTHY:], size), wanted, PER_YEAR)
    after, sizes = np.array([one[0] for one in changed]), np.array([one[1] for one in changed])
    return rivals.first(rivals.cusum(after[:, HEALTHY:], sizes), bar)


def main(axes: int, years: int, first: int, tries: int, few: int, watch_only: bool) -> None:
    warnings.simplefilter("ignore")
    begin, pool = time.process_time(), Pool()
    healthy = Healthy(years, first, pool)
    count, spent = int((healthy.watch <= YEAR).sum()), float(np.minimum(healthy.watch, YEAR).sum() / PER_YEAR)
    low, high = interval(count, spent)
    print(
        f"{axes} axes with a change, {years} healthy ones for the bars (seeds from {first}), {len(pool)} real answers, "
        f"scatter {Axis(0, 0).scatter:.1%}, two windows a day, {HEALTHY} healthy windows before; "
        "mean delays in windows\n"
        f"the watch's own first false alarms a year: {count / spent:.2f} [{low:.2f}, {high:.2f}]; "
        f"{time.process_time() - begin:.0f} s",
        flush=True,
    )
    changed = Changed(axes, first + 1000, pool)
    rates = {1.0, round(max(count, 0.5) / spent, 2)}
    for wanted in sorted(rates, reverse=True):
        compare(healthy, changed, wanted, tries, few) if not watch_only else quick(healthy, changed, wanted)
    print(f"{time.process_time() - begin:.0f} s of CPU")


def quick(healthy: Healthy, changed: Changed, wanted: float) -> None:
    """Watch and optimum only."""
    for (what, shape, size), delays, deviations in _cases(healthy, changed):
        shifts = {f: healthy.shift(f, dict.fromkeys(KINDS[what], 1 + size)) for f in healthy.speeds}
        lives = [(life.axis.family, dev) for life, dev in zip(changed.lives, deviations, strict=True)]
        optimum, unknown = _optimum(healthy, lives, shifts, wanted), _unknown(healthy, lives, wanted)
        by = [f"{delays[np.array([f == g for f, _ in lives])].mean():.1f}" for g in sorted(shifts)]
        print(
            f"at {wanted:g}/a {what} {shape} {size:+.0%}: watch {delays.mean():.2f} {by}, "
            f"optimum {optimum.mean():.2f}, ratio {delays.mean() / optimum.mean():.2f}, change unknown "
            f"{unknown.mean():.2f}, ratio {delays.mean() / unknown.mean():.2f}",
            flush=True,
        )


def untold(axes: int, first: int) -> None:
    """The watch on axes that do not tell their temperature: what they find out, and when."""
    warnings.simplefilter("ignore")
    changed = Changed(axes, first + 1000, Pool(), tells=False)
    print(f"{len(changed.lives)} axes without temperature (seeds from {first + 1000}); delays in windows", flush=True)
    for what, names in KINDS.items():
        for shape in ("step", "ramp"):
            for size in SIZES:
                delays, _ = changed.run(names, shape, size)
                missed = int((delays > AFTER).sum())
                print(f"{what} {shape} {size:+.0%}: median {np.median(delays):.0f}, mean {delays.mean():.1f}, "
                      f"not within {AFTER} windows: {missed}", flush=True)  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=120)
    parser.add_argument("--years", type=int, default=240, help="healthy axis-years that set the bars")
    parser.add_argument("--first", type=int, default=JUDGING)
    parser.add_argument("--tries", type=int, default=7, help="halvings of river's bars")
    parser.add_argument("--few", type=int, default=60, help="axes of PELT and river, which are slow")
    parser.add_argument("--quick", action="store_true", help="watch and optimum only")
    parser.add_argument("--untold", action="store_true", help="watch only, on axes that tell no temperature")
    given = parser.parse_args()
    if given.untold:
        untold(given.axes, given.first)
    else:
        main(given.axes, given.years, given.first, given.tries, given.few, given.quick)
