"""The story of one number in a few dozen means, and where it leads: remaining life, or why none is given. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

BLOCKS = 48  # means kept; when full, neighbours are merged
FEWEST = 8  # means behind a projection
SURE = 3.0  # standard errors of the slope
FURTHEST = 3.0  # times the stretch that was seen: a projection beyond it would be a guess
BENT = 3.0  # standard errors of a bend: then a straight line says nothing about the future
DAY_NS = 86_400 * 10**9
Block = tuple[float, float, float]  # mean time [ns], mean relative change [1], windows


@dataclass(frozen=True, slots=True)
class Projection:
    """When the limit is reached.

    Attributes:
        limit: relative change that counts as the end. [1]
        per_day: slope. [1/d], None where none is given
        days: to the limit, from the latest window; with a 95 % interval, whose upper end may be open (None). [d]
        refused: why there is no projection.
    """

    limit: float
    per_day: float | None = None
    days: float | None = None
    days_low: float | None = None
    days_high: float | None = None
    refused: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def added(blocks: tuple[Block, ...], time_ns: int, change: float) -> tuple[Block, ...]:
    """The story with one more window."""
    blocks = (*blocks, (float(time_ns), round(change, 6), 1.0))
    if len(blocks) <= BLOCKS:
        return blocks
    lightest = min(range(len(blocks) - 1), key=lambda i: blocks[i][2] + blocks[i + 1][2])
    (t1, x1, n1), (t2, x2, n2) = blocks[lightest : lightest + 2]
    n = n1 + n2
    both = ((t1 * n1 + t2 * n2) / n, (x1 * n1 + x2 * n2) / n, n)
    return (*blocks[:lightest], both, *blocks[lightest + 2 :])


def project(
    blocks: tuple[Block, ...], since_ns: int, scatter: float, correlation: float, limit: float, bias: float = 0.0
) -> Projection:
    """Straight line through the means since `since_ns`, to `limit`.

    Args:
        blocks: of `added`.
        since_ns: onset of the change. [ns]
        scatter: of one window, relative. [1]
        correlation: of neighbouring windows. [1]
        limit: relative change that counts as the end. [1]
        bias: uncertainty of the level they are relative to. [1]
    """
    part = np.array([block for block in blocks if block[0] >= since_ns])
    if len(part) < FEWEST:
        return Projection(limit, refused=f"{len(part)} means since the change began, {FEWEST} are needed for a trend")
    now = part[-1, 0]
    t, x, n = (part[:, 0] - now) / DAY_NS, part[:, 1], part[:, 2]
    stretch = float(-t[0])
    if stretch <= 0:
        return Projection(limit, refused="all windows carry the same time")
    variance = scatter**2 * (1 + correlation) / (1 - correlation) / n
    design = np.column_stack([np.ones_like(t), t])
    covariance = np.linalg.inv(design.T @ (design / variance[:, None]))
    line = covariance @ (design.T @ (x / variance))
    misfit = float(np.sum((x - design @ line) ** 2 / variance)) / max(len(t) - 2, 1)
    covariance *= max(misfit, 1.0)  # what a line does not explain makes it less sure
    slope, error = float(line[1]), float(np.sqrt(covariance[1, 1]))
    if slope < SURE * error:
        return Projection(limit, refused=f"no steady rise: {slope * 30:+.1%} ± {1.96 * error * 30:.1%} in 30 days")
    curved = np.column_stack([design, t**2])
    spread = np.linalg.inv(curved.T @ (curved / variance[:, None]))
    bend = (spread @ (curved.T @ (x / variance)))[2]
    if abs(bend) > BENT * np.sqrt(spread[2, 2]) and abs(bend) * stretch > 0.5 * slope:
        kind = "faster and faster" if bend > 0 else "slower and slower"
        return Projection(limit, slope, refused=f"the change goes {kind}: a straight line would mislead")
    left = limit - float(line[0])
    if left <= 0:
        return Projection(limit, slope, 0.0, 0.0, 0.0)
    days = left / slope
    if days > FURTHEST * stretch:
        seen = f"{FURTHEST:g} times the {stretch:.0f} days seen"
        return Projection(limit, slope, refused=f"at this pace the limit is further away than {seen}")
    draws = np.random.default_rng(0).multivariate_normal(line, covariance, 2000)
    room = limit - draws[:, 0] + bias * np.random.default_rng(1).standard_normal(2000)
    reach = np.where(draws[:, 1] > 0, np.maximum(room, 0.0) / np.maximum(draws[:, 1], 1e-12), np.inf)
    low, high = np.quantile(reach, [0.025, 0.975])
    return Projection(limit, slope, days, float(low), float(high) if np.isfinite(high) else None)
