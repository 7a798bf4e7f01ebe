"""What the sensors and the drive make of the truth: sampling, noise, resolution, delay, jitter, lost samples."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensors:
    """How a run is recorded.

    Attributes:
        period: sample time of the recording; a whole multiple of the run's stamps. [s]
        position_noise, position_step: standard deviation and resolution. [m or rad]
        position_delay: the position is this late. [s]
        side: "load" or "motor".
        force: "held" (command from this stamp on), "mean" (over the sample), "point" (one instant of a faster loop).
        force_noise, force_step: of the reported force. [N]
        jitter: standard deviation of the instants of sampling. [s]
        stamps: "true" (jitter is in the column t) or "nominal" (t pretends there is none).
        lost: share of rows that are missing. [1]
        stale: share of rows that repeat the position before. [1]
        gaps: (start, end) in which no rows exist. [s]
        speed_noise: standard deviation of a velocity column, None = no such column. [m/s]
        encoder_error, encoder_period: periodic error of the position sensor. [m]
        slip: (instant, jump): the position sensor loses steps. [s], [m]
    """

    period: float = 0.01
    position_noise: float = 0.0
    position_step: float = 0.0
    position_delay: float = 0.0
    side: str = "load"
    force: str = "held"
    force_noise: float = 0.0
    force_step: float = 0.0
    jitter: float = 0.0
    stamps: str = "true"
    lost: float = 0.0
    stale: float = 0.0
    gaps: tuple[tuple[float, float], ...] = ()
    speed_noise: float | None = None
    encoder_error: float = 0.0
    encoder_period: float = 1.0
    slip: tuple[float, float] | None = None


def record(truth: dict[str, np.ndarray], sensors: Sensors, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Columns t, force, position (and velocity) of the recording of a run by `machine.run`.

    Returns:
        Arrays (m,); the column t increases strictly.
    """
    every = round(sensors.period / (truth["t"][1] - truth["t"][0]))
    if every < 1 or abs(every * (truth["t"][1] - truth["t"][0]) - sensors.period) > 1e-9:
        raise ValueError("the recording's period must be a whole multiple of the run's stamps")
    rows = np.arange(0, len(truth["t"]) - every + 1, every)
    nominal = truth["t"][rows]
    most = 0.4 * sensors.period
    instants = nominal + np.clip(sensors.jitter * rng.standard_normal(len(rows)), -most, most)
    columns = {
        "t": instants if sensors.stamps == "true" else nominal,
        "force": _force(truth["force_command"], rows, every, sensors, rng),
        "position": _position(truth, instants - sensors.position_delay, sensors, rng),
    }
    if sensors.speed_noise is not None:
        speed = np.interp(instants, truth["t"], truth["velocity"])
        columns["velocity"] = speed + sensors.speed_noise * rng.standard_normal(len(rows))
    return _without_lost(columns, sensors, rng)


def _force(command, rows, every, sensors, rng):
    if sensors.force == "mean":
        padded = np.concatenate([command, np.full(every, command[-1])])
        reported = np.array([padded[row : row + every].mean() for row in rows])
    else:
        reported = command[rows].copy()
    reported += sensors.force_noise * rng.standard_normal(len(rows))
    return _grid(reported, sensors.force_step)


def _position(truth, instants, sensors, rng):
    source = truth["position" if sensors.side == "load" else "motor_position"]
    seen = np.interp(instants, truth["t"], source)
    seen = seen + sensors.encoder_error * np.sin(2 * np.pi * seen / sensors.encoder_period)
    if sensors.slip is not None:
        seen = seen + np.where(instants >= sensors.slip[0], sensors.slip[1], 0.0)
    seen = _grid(seen + sensors.position_noise * rng.standard_normal(len(seen)), sensors.position_step)
    for row in np.flatnonzero(rng.random(len(seen)) < sensors.stale):
        seen[row] = seen[max(row - 1, 0)]
    return seen


def _grid(values, step):
    return step * np.round(values / step) if step > 0 else values


def _without_lost(columns, sensors, rng):
    t = columns["t"]
    keep = rng.random(len(t)) >= sensors.lost
    for start, end in sensors.gaps:
        keep &= (t < start) | (t >= end)
    return {name: values[keep] for name, values in columns.items()}
