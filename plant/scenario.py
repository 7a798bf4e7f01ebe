"""A machine over months, in bursts, as a normal machine sends: one frozen value in, recordings with their times out.

A burst is a pure function of (scenario, number): any burst can be had without those before it; same scenario and
seed give the same samples. The machine works between the bursts; `travel_per_day` says how far.
"""

from __future__ import annotations

import dataclasses
import datetime as dt
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from plant.ageing import DAY, Ageing, Condition, Moment
from plant.axis import Axis
from plant.effects import EffectValues
from plant.errors import ParameterError
from plant.excitation import Excitation
from plant.friction import StribeckFriction
from plant.motion import ClosedLoop, record_motion, simulate_motion
from plant.recording import Recording
from plant.sensors import Sensors
from plant.simulation import simulate

NANOSECONDS = 1_000_000_000
SAMPLE_TIME = 0.01  # s, §4.1; for an axis whose file says nothing


@dataclass(frozen=True, slots=True)
class Bursts:
    """When the machine records.

    Attributes:
        start: of the first burst, with time zone; the time of day is that of its zone.
        samples: in each burst. >= 2
        interval_hours: from burst to burst. [h] > 0
        days: the scenario ends before this day. [d] > 0
        travel_per_day: distance the axis travels in a day's work. [m/d] >= 0
        start_position: where each burst begins, at rest; None takes the middle of the travel. [m or rad]
    """

    start: dt.datetime
    samples: int = 2000
    interval_hours: float = 12.0
    days: float = 180.0
    travel_per_day: float = 2000.0
    start_position: float | None = None

    def __post_init__(self) -> None:
        """Check ranges."""
        for name, unit in (("interval_hours", "h"), ("days", "d")):
            if not getattr(self, name) > 0:
                raise ParameterError(f"bursts: {name}", getattr(self, name), "> 0", unit)
        if self.samples < 2:
            raise ParameterError("bursts: samples", self.samples, ">= 2", "samples")
        if self.travel_per_day < 0:
            raise ParameterError("bursts: travel_per_day", self.travel_per_day, ">= 0", "m/d")

    def __len__(self) -> int:
        """Count the bursts that begin before the end."""
        return math.ceil(self.days * 24.0 / self.interval_hours - 1e-9)

    def time(self, number: int) -> float:
        """Begin of burst `number` since the start of the scenario. [s]"""
        return number * self.interval_hours * 3600.0


@dataclass(frozen=True, slots=True)
class Fault:
    """Sensors and drive that misbehave during some days, on top of what they always do.

    Attributes:
        sensors: what they do then.
        from_day: [d]
        to_day: [d]
    """

    sensors: Sensors
    from_day: float = 0.0
    to_day: float = 1e9

    def acts(self, time: float) -> bool:
        """True at `time` since the start of the scenario. [s]"""
        return self.from_day * DAY <= time < self.to_day * DAY


@dataclass(frozen=True, slots=True, eq=False)
class Burst:
    """One recording of a scenario and the truth behind it.

    Attributes:
        number: from 0.
        time: begin since the start of the scenario. [s]
        begin_ns: begin as Unix time in UTC. [ns]
        recording: as sensors and drive report it; its stamps count from the begin of the burst.
        friction: the law that acted.
        condition: what the months have done to the axis.
    """

    number: int
    time: float
    begin_ns: int
    recording: Recording
    friction: StribeckFriction
    condition: Condition


@dataclass(frozen=True, slots=True)
class Scenario:
    """An axis, what moves it, what it sends, and how it ages.

    Attributes:
        name: for messages.
        axis: as new.
        friction: as new.
        drive: the torque of each burst, or the closed loop that makes it.
        bursts: when.
        sensors: what they do to the samples.
        ageing: what the months do to the axis.
        faults: what goes wrong with the sensors, one after the other.
        effects: named effects that are there from the start: name -> parameter -> value.
        seed: of everything that happens by chance.
        description: one line for people.
    """

    name: str
    axis: Axis
    friction: StribeckFriction
    drive: Excitation | ClosedLoop
    bursts: Bursts
    sensors: Sensors = Sensors()  # noqa: RUF009  # frozen
    ageing: Ageing = Ageing()  # noqa: RUF009  # frozen
    faults: tuple[Fault, ...] = ()
    effects: EffectValues = field(default_factory=dict)
    seed: int = 0
    description: str = ""

    def __len__(self) -> int:
        """Count the bursts."""
        return len(self.bursts)

    def __iter__(self) -> Iterator[Burst]:
        """All bursts in the order of time."""
        return (self.burst(number) for number in range(len(self)))

    def moment(self, time: float) -> Moment:
        """When `time` [s since the start] is, in the words of ageing."""
        start = self.bursts.start
        midnight = start.replace(hour=0, minute=0, second=0, microsecond=0)
        return Moment(
            time=time,
            travelled=self.bursts.travel_per_day * time / DAY,
            time_of_day=((start - midnight).total_seconds() + time) % DAY,
            seed=self.seed,
        )

    def burst(self, number: int) -> Burst:
        """Simulate burst `number`, 0 <= number < len.

        Raises:
            ParameterError: no such burst; or the physics of the scenario goes out of range.
        """
        if not 0 <= number < len(self):
            raise ParameterError("burst", number, f"in 0..{len(self) - 1}")
        time = self.bursts.time(number)
        condition = self.ageing.condition(self.moment(time))
        friction = condition.friction(self.friction)
        true = self._run(condition, friction, f"scenario {self.name}, burst {number}")
        rng = np.random.default_rng([self.seed, number])
        seen = true
        for sensors in (self.sensors, *(fault.sensors for fault in self.faults if fault.acts(time))):
            seen = sensors.apply(seen, self.axis.mechanics.gain, self.axis.drive.rated_force, rng)
        return Burst(number, time, self.begin_ns(number), seen, friction, condition)

    def begin_ns(self, number: int) -> int:
        """Unix time in UTC at which burst `number` begins. [ns]"""
        return unix_ns(self.bursts.start + dt.timedelta(seconds=self.bursts.time(number)))

    def _run(self, condition: Condition, friction: StribeckFriction, source: str) -> Recording:
        """What truly happens in one burst, at the rate of the stream."""
        axis = loaded(self.axis, condition.load)
        effects = {**self.effects, **dict(condition.effects)}
        if isinstance(self.drive, ClosedLoop):
            bare = self._moved(self.drive, axis, friction, effects)
        else:
            bare = self._pushed(self.drive, axis, friction, effects)
        n = len(bare)
        return dataclasses.replace(
            bare,
            velocity=bare.velocity if self.sensors.report_velocity else None,
            temperature=np.full(n, condition.temperature) if self.sensors.report_temperature else None,
            load=np.full(n, condition.load) if self.sensors.report_load else None,
            source=source,
        )

    def _pushed(self, drive: Excitation, axis: Axis, friction: StribeckFriction, effects: EffectValues) -> Recording:
        """One burst in open loop."""
        torque = drive.torque(self.sample_time * np.arange(self.bursts.samples))
        path = simulate(
            axis,
            friction,
            torque,
            sample_time=self.sample_time,
            hold=axis.stream.hold,
            effects=effects,
            position0=self.start_position,
        )
        return Recording(
            t=path.t,
            force=axis.mechanics.gain * torque,
            position=path.position,
            velocity=path.velocity,
            sample_time=self.sample_time,
            hold=axis.stream.hold,
        )

    def _moved(self, loop: ClosedLoop, axis: Axis, friction: StribeckFriction, effects: EffectValues) -> Recording:
        """One burst in closed loop; the controller knows the axis without its payload."""
        duration = self.bursts.samples * self.sample_time
        run = simulate_motion(axis, friction, loop, duration, effects=effects, known=self.axis)
        return record_motion(run, loop, self.sample_time)

    @property
    def sample_time(self) -> float:
        """Of the stream. [s]"""
        return self.axis.stream.sample_time or SAMPLE_TIME

    @property
    def start_position(self) -> float:
        """Where each burst in open loop begins; a closed loop begins at its reference. [m or rad]"""
        if self.bursts.start_position is not None:
            return self.bursts.start_position
        travel = self.axis.mechanics.travel
        return 0.0 if travel is None else 0.5 * (travel[0] + travel[1])


def loaded(axis: Axis, load: float) -> Axis:
    """`axis` with a payload of `load` [kg; kg·m² on a rotary axis] that moves, and weighs, with it."""
    if not load:
        return axis
    m = axis.mechanics
    heavier = dataclasses.replace(m, J=m.J + load) if axis.is_rotary else dataclasses.replace(m, M=m.M + load)
    return dataclasses.replace(axis, mechanics=heavier)


def unix_ns(moment: dt.datetime) -> int:
    """`moment` as Unix time in UTC, exact to its microseconds. [ns]"""
    since = moment - dt.datetime(1970, 1, 1, tzinfo=dt.UTC)
    return (since.days * 86400 + since.seconds) * NANOSECONDS + since.microseconds * 1000


def join(bursts: Sequence[Burst]) -> Recording:
    """Put several bursts into one recording: stamps count from the begin of the first, gaps stay gaps.

    Raises:
        ParameterError: no burst at all.
    """
    if not bursts:
        raise ParameterError("bursts", 0, ">= 1", "bursts")
    first = bursts[0].recording
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(burst.recording, name) for burst in bursts]) for name in first.channels()
    }
    columns["t"] = np.concatenate([(burst.time - bursts[0].time) + burst.recording.t for burst in bursts])
    return dataclasses.replace(first, **columns)
