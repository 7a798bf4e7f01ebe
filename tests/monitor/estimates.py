"""Estimates as identification would give them, for tests of what comes after it: friction law, errors, times."""

import numpy as np

from monitor.estimate import Curve, Estimate, Parameter
from monitor.samples import Window, WindowId

GRID = 10.0 ** (np.arange(-16, 0) / 8)
FASTEST = 0.5  # m/s
DAY_NS = 86_400 * 10**9
LAW = {"coulomb": 90.0, "static": 78.0, "stribeck": 0.1, "viscous": 180.0}
WEIGHT = 196.0  # N


def friction(v, coulomb, static, stribeck, viscous):
    return coulomb + (static - coulomb) * np.exp(-v / stribeck) + viscous * v


def estimate(
    number, rng=None, *, scatter=0.01, error=0.005, every_ns=DAY_NS, verdict="identified", fastest=FASTEST,
    temperature=None, load=None, latent=None, constant=None, scale=1.0, noise=None, effects=(), faults=None, **changes,
):  # fmt: skip
    """Window `number`; `changes` are factors on the law. Scatter is of the machine, error of the identification.

    `scale` is a torque read too large by that factor; `latent` [N] and `constant` [N] are what the model leaves
    unexplained and the constant force; `effects` are parameters of promoted ones, (name, value, unit).
    """
    law = {name: value * changes.get(name, 1.0) for name, value in LAW.items()}
    values = friction(GRID, **law)
    if rng is not None:
        level, tilt = rng.standard_normal(2) if noise is None else noise
        values = values * (1 + scatter * (level + 0.5 * tilt * (GRID / FASTEST - 0.5)))
        values = values + error * values * rng.standard_normal()
    values = scale * values
    half = 1.96 * error * values
    curve = Curve(tuple(GRID), tuple(values), tuple(values - half), tuple(values + half), fastest)
    start = number * every_ns
    parameters = [Parameter("stribeck_velocity", law["stribeck"], "m/s", 0.09, 0.11)]
    if constant is not None:
        value = constant + (scale - 1) * WEIGHT + (0.3 * rng.standard_normal() if rng is not None else 0.0)
        parameters.append(Parameter("constant_force", value, "N", value - 0.5, value + 0.5))
    for name, value, unit in effects:
        parameters.append(Parameter(name, value, unit, value - 0.5, value + 0.5))
    conditions = {"temperature": temperature, "load": load}
    if latent is not None:
        conditions["latent_force"] = latent * (float(np.exp(0.2 * rng.standard_normal())) if rng is not None else 1.0)
    return Estimate(
        Window(WindowId(1, 2000 * number, 2000), start, start + 20 * 10**9),
        verdict, None if verdict == "identified" else "a reason", "ga+polish", 0, "0", "sha", {},
        parameters=tuple(parameters), curve=curve if verdict == "identified" else None,
        conditions={name: value for name, value in conditions.items() if value is not None}, faults=faults or {},
    )  # fmt: skip
