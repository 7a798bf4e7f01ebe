"""Sums a baseline is made of: values (J,) against what moves them, temperature and load (p,). Pure."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from plant.recording import Floats

PER_KELVIN = 0.015  # 1/K: how friction usually moves with temperature (greases 2-4 % of the viscous part, Simoni 2015)
PER_LOAD = 0.5  # of friction, per largest load seen: rolling and plain guides lie below it
CORRELATION, PRIOR_WINDOWS = 0.2, 20  # windows one after the other err alike; what is believed before, and how firmly
HIGHEST_CORRELATION = 0.9
PRIOR_BLOCKS = 3  # behind what is believed of the wandering before it was seen
LEAST_WANDERING = 0.5  # of what is believed
MOST_WANDERING = 0.01  # of the scale: more must not be taken for normal, or wear would be too
BLOCK = 20  # windows that refine the baseline together, and whose means show the wandering
FINEST = 1e-3  # of the scale: no friction repeats better
LOG_FINEST = 0.1  # of a logarithm of unexplained force: it is estimated on half decades of the observer


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Centred sums over windows; levels come from `n` windows, slopes and scatter from more.

    Attributes:
        n: windows behind the means.
        mean_x, mean_y: (p,), (J,)
        sxx, sxy, syy: centred sums (p, p), (p, J), (J, J), over all blocks, each about its own mean once n is full.
        dof: windows behind the sums, less one for each mean.
        lag_product, lag_square: sums of r(t) r(t-1) and r(t)² of residuals. (J,)
        blocks: later blocks compared with the level.
        wandered: sum of their squared deviations from it, less what scatter alone would make. (J,)
    """

    n: int
    mean_x: Floats
    mean_y: Floats
    sxx: Floats
    sxy: Floats
    syy: Floats
    dof: int
    lag_product: Floats
    lag_square: Floats
    blocks: int
    wandered: Floats

    @classmethod
    def of(cls, x: Floats, y: Floats) -> Moments:
        """Sums of one block x (n, p), y (n, J); the autocorrelation is added by `with_lags`."""
        mean_x, mean_y = x.mean(axis=0), y.mean(axis=0)
        dx, dy = x - mean_x, y - mean_y
        zeros = np.zeros(y.shape[1])
        return cls(len(x), mean_x, mean_y, dx.T @ dx, dx.T @ dy, dy.T @ dy, len(x) - 1, zeros, zeros, 0, zeros)

    def with_lags(self, residuals: Floats) -> Moments:
        """Add the residuals (n, J) of consecutive windows to the sums of the autocorrelation."""
        product = (residuals[1:] * residuals[:-1]).sum(axis=0)
        return dataclasses.replace(
            self, lag_product=self.lag_product + product, lag_square=self.lag_square + (residuals**2).sum(axis=0)
        )

    def joined(self, other: Moments) -> Moments:
        """Both blocks as one: means and sums."""
        n = self.n + other.n
        share = self.n * other.n / n
        dx, dy = other.mean_x - self.mean_x, other.mean_y - self.mean_y
        return dataclasses.replace(
            self.beside(other),
            n=n,
            mean_x=self.mean_x + dx * other.n / n,
            mean_y=self.mean_y + dy * other.n / n,
            sxx=self.sxx + other.sxx + share * np.outer(dx, dx),
            sxy=self.sxy + other.sxy + share * np.outer(dx, dy),
            syy=self.syy + other.syy + share * np.outer(dy, dy),
            dof=self.dof + other.dof + 1,
        )

    def beside(self, other: Moments) -> Moments:
        """Slopes and scatter learn from the other block, the level does not: slow wear must not become normal."""
        return dataclasses.replace(
            self,
            sxx=self.sxx + other.sxx,
            sxy=self.sxy + other.sxy,
            syy=self.syy + other.syy,
            dof=self.dof + other.dof,
            lag_product=self.lag_product + other.lag_product,
            lag_square=self.lag_square + other.lag_square,
            blocks=self.blocks + other.blocks,
            wandered=self.wandered + other.wandered,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return {name: one.tolist() if isinstance(one, np.ndarray) else one for name, one in fields.items()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Moments:
        """Read what `to_dict` wrote."""
        p, j = len(values["mean_x"]), len(values["mean_y"])
        shapes = {"sxx": (p, p), "sxy": (p, j), "syy": (j, j)}
        arrays: dict[str, Any] = {
            name: np.array(one, dtype=np.float64).reshape(shapes.get(name, -1)) if isinstance(one, list) else one
            for name, one in values.items()
        }
        return cls(**arrays)


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """What the sums say.

    Attributes:
        slopes: change of each number per unit of what moves it. (p, J)
        spread: (Sxx + prior)^-1 of each number; times `variance` the covariance of its slopes. (J, p, p)
        variance: of one window about the prediction. (J,)
        correlation: of neighbouring windows. (J,)
        wandering: variance of what wanders over days; `most` of it that may be believed. (J,)
        untold: variance of what moves it and is not told. (J,)
        dof: degrees of freedom of the variance.
        wandering_dof: of the wandering.
    """

    slopes: Floats
    spread: Floats
    variance: Floats
    correlation: Floats
    wandering: Floats
    most: Floats
    untold: Floats
    dof: float
    wandering_dof: float


def fitted(
    moments: Moments, scales: Floats, finest: Floats, widths: Floats, wandering: Floats, untold: Floats
) -> Fitted:
    """Ridge regression of every number: slopes shrink to zero where the windows did not vary.

    Args:
        moments: sums.
        scales: of the numbers. (J,)
        finest: least standard deviation. (J,)
        widths: standard deviation of a slope before anything was seen, relative to the scale. (p,)
        wandering: how far each number is believed to wander over days before anything was seen. (J,)
        untold: standard deviation of what moves the numbers and is not told. (J,)
    """
    p, count = moments.sxy.shape
    slopes, spread = np.zeros((p, count)), np.zeros((count, p, p))
    variance = np.diag(moments.syy) / max(moments.dof, 1)
    for j in range(count if p else 0):
        prior = np.maximum(widths * scales[j], 1e-300) ** -2.0
        for _ in range(3):
            spread[j] = np.linalg.inv(moments.sxx + np.diag(variance[j] * prior) + 1e-12 * np.eye(p))
            slopes[:, j] = spread[j] @ moments.sxy[:, j]
            rest = moments.syy[j, j] - 2 * slopes[:, j] @ moments.sxy[:, j] + slopes[:, j] @ moments.sxx @ slopes[:, j]
            used = float(np.trace(spread[j] @ moments.sxx))
            variance[j] = max(float(rest), 0.0) / max(moments.dof - used, 1.0) + 1e-300
    variance = np.maximum(variance, finest**2)
    believed = PRIOR_WINDOWS * variance
    correlation = (moments.lag_product + CORRELATION * believed) / (moments.lag_square + believed)
    correlation = np.clip(correlation, 0.0, HIGHEST_CORRELATION)
    wandered = (PRIOR_BLOCKS * wandering**2 + moments.wandered) / (PRIOR_BLOCKS + moments.blocks)
    most = (MOST_WANDERING * scales) ** 2
    wandered = np.clip(wandered, (LEAST_WANDERING * wandering) ** 2, most)
    return Fitted(
        slopes, spread, variance, correlation, wandered, most, untold**2, float(max(moments.dof - p, 3)),
        float(PRIOR_BLOCKS + moments.blocks),
    )  # fmt: skip
