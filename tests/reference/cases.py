"""Blind recordings: a machine drawn from a seed, something (or nothing) hidden in it, recordings, sealed labels.

The label says what was hidden; `write_case` writes only what a user would have: axis.toml and CSV files.
"""

import math
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from . import foreign
from .draws import (
    CLOSED_KINDS,
    SLOW_LOOP,
    TWO_MASS,
    Facts,
    draw_effect,
    draw_excitation,
    draw_outside,
    draw_plant,
    draw_shapes,
)
from .excitation import Motion, Torque, sine, stamps
from .machine import run
from .parameters import ReferencePlant
from .recording import Sensors, record

HELPERS = {"middle", "side", "payload", "slip", "both", "phase"}  # parameters no result has to name


class UndrawableError(Exception):
    """This seed gives a machine that runs away, hardly moves or shakes; take the next."""


@dataclass(frozen=True)
class CaseSpec:
    """What to draw.

    Attributes:
        seed: everything else follows from it, bit for bit.
        effects: catalogue names hidden together; () = nothing.
        outside: one name of `foreign.OUTSIDE`, or None.
        excitation: a kind of `draws`, or "still" (hardly moves: insufficient data).
        size: 1 = 8-15 % of the dry friction; 0.25 is small.
        noise: standard deviation of the position, on a machine with 0.4 m of travel. [m]
        period: of the recording. [s]
        duration: of each recording. [s]
        recordings: how many of the same state, each with another draw of the excitation.
        before: True puts a recording without the effects first, noted commissioning, the others noted today.
        wear: times the dry friction of every recording but the first of `before`.
        dirt: force that does not repeat, rms in shares of F_c.
        rough: the dry level wanders by this share, slowly.
        shapes: "catalogue" or "foreign" (another author's curves).
        artefacts: "clean", "typical" (resolution, drive torque noise), "harsh" (jitter, delay, lost, stale rows too).
        orientation: vertical, horizontal, rotary.
        exponent: of the Stribeck curve.
    """

    seed: int
    effects: tuple[str, ...] = ()
    outside: str | None = None
    excitation: str = "sine"
    size: float = 0.5
    noise: float = 1e-4
    period: float = 0.01
    duration: float = 30.0
    recordings: int = 2
    before: bool = False
    wear: float = 1.0
    dirt: float = 0.005
    rough: float = 0.0
    shapes: str = "catalogue"
    artefacts: str = "typical"
    orientation: str = "vertical"
    exponent: float = 1.0


@dataclass(frozen=True)
class Case:
    """A drawn case: `axis` (as in axis.toml) and `recordings` for the tool; `labels`, `plant`, `truths` stay sealed."""

    spec: CaseSpec
    axis: dict
    recordings: list[dict]
    labels: dict
    plant: ReferencePlant
    truths: list[dict] = field(repr=False)


def draw_case(spec: CaseSpec) -> Case:
    """Draw one case.

    Raises:
        UndrawableError: the machine of this seed runs away or hardly moves with what is hidden in it.
    """
    rng = np.random.default_rng([20051, spec.seed])
    plain = replace(draw_plant(rng, spec.orientation), stribeck_exponent=spec.exponent)
    count = spec.recordings + (1 if spec.before else 0)
    cautious = 0.03 * spec.size * 1.5 if set(spec.effects) & set(SLOW_LOOP) else 0.0
    excitations = [_excite(rng, spec, plain, cautious) for _ in range(count)]
    facts = Facts.of(run(plain, excitations[0], step=5e-4))
    plant = _hide(rng, spec, plain, facts)
    series = _outer_label(rng, spec, plain, facts)
    truths, recordings, labels = [], [], _labels(spec, plant, series, 2 * facts.half)
    sensors = _draw_sensors(rng, spec, plain, facts, series)
    for number, excitation in enumerate(excitations):
        healthy = spec.before and number == 0
        machine = plain if healthy else plant
        truth = _run_trimmed(rng, spec, machine, excitation, facts, {} if healthy else series)
        truths.append(truth)
        columns = record(truth, replace(sensors, encoder_error=0.0, slip=None) if healthy else sensors, rng)
        note = ("commissioning" if healthy else "today") if spec.before else f"run {number + 1}"
        recordings.append({"columns": columns, "note": note, "loop": _loop(spec), "torque": _words(sensors)})
    return Case(spec, _axis(spec, plain, sensors, facts), recordings, labels, plant, truths)


def _loop(spec):
    return "closed" if spec.excitation in CLOSED_KINDS else "open"


def _words(sensors):
    return "mean of the sample" if sensors.force == "mean" else "held over the sample"


def _excite(rng, spec, plain, cautious):
    if spec.excitation == "still":
        t = stamps(spec.duration, spec.period)
        push = 0.6 * min(plain.static_force, plain.coulomb_force) * sine(t, 1.0, rng.uniform(0.1, 0.5))
        return Torque(t, (plain.weight + push) / plain.gain)
    excitation = draw_excitation(rng, spec.excitation, plain, spec.duration, spec.period, cautious=cautious)
    if isinstance(excitation, Motion) and set(spec.effects) & set(TWO_MASS):
        return replace(excitation, loop=replace(excitation.loop, motor_side=True))
    return excitation


def _hide(rng, spec, plain, facts):
    effects = {name: draw_effect(rng, name, plain, facts, spec.size) for name in spec.effects}
    shapes = draw_shapes(rng, effects) if spec.shapes == "foreign" else {}
    strange = {}
    if spec.outside in foreign.IN_THE_EQUATIONS:
        strange = {spec.outside: draw_outside(rng, spec.outside, plain, facts, spec.size)}
    dry = {name: spec.wear * getattr(plain, name) for name in ("coulomb_force", "static_force")}
    return replace(plain, effects=effects, shapes=shapes, foreign=strange, **dry)


def _outer_label(rng, spec, plain, facts):
    """Parameters of what enters as a series or through the sensor."""
    f, start = plain.coulomb_force * spec.size, rng.uniform(0.2, 0.7) * spec.duration
    return {
        "outer_sine": {"amplitude": 0.12 * f, "frequency": rng.uniform(0.8, 3.0), "phase": rng.uniform(0, 6)},
        "outer_pulse": {"amplitude": 0.5 * f, "start": start, "length": rng.uniform(2.0, 5.0)},
        "sticking_bursts": {"height": 0.6 * f, "rate": 0.8, "length": 0.25, "start": start, "end": start + 8.0},
        "encoder_error": {"error": 0.004 * spec.size * facts.half, "period": rng.uniform(0.1, 0.3) * facts.half},
        "sensor_slip": {"start": start, "jump": 0.05 * spec.size * facts.half},
    }.get(spec.outside or "", {})


def _labels(spec, plant, series, travel):
    outside = None
    if spec.outside:
        values = series or dict(plant.foreign[spec.outside])
        interval = None
        if spec.outside in ("outer_pulse", "sticking_bursts", "sensor_slip"):
            interval = [values["start"], values.get("end", values["start"] + values.get("length", 0.0))]
        elif spec.outside == "outer_sine":
            interval = [values["frequency"], values["frequency"]]
        elif spec.outside == "detent":
            interval = [values["centre"] - 2 * values["width"], values["centre"] + 2 * values["width"]]
        outside = {"name": spec.outside, "parameters": values, "coordinates": list(foreign.OUTSIDE[spec.outside]),
                   "interval": interval}  # fmt: skip
    shown = {n: {k: v for k, v in e.items() if k not in HELPERS} for n, e in plant.effects.items()}
    friction = {
        k: getattr(plant, k) for k in ("coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient")
    }
    expected = "unexplained" if spec.outside else ("explained" if spec.effects else "no_mismatch")
    return {"spec": asdict(spec), "travel": travel, "effects": shown, "outside": outside, "friction": friction,
            "shapes": dict(plant.shapes),
            "expected": "insufficient_data" if spec.excitation == "still" else expected}  # fmt: skip


def _draw_sensors(rng, spec, plain, facts, series):
    reach = facts.half / 0.2 if plain.orientation == "rotary" else 1.0  # noise in rad, relative to the travel
    sensors = Sensors(period=spec.period, position_noise=spec.noise * reach)
    if spec.outside == "encoder_error":
        sensors = replace(sensors, encoder_error=series["error"], encoder_period=series["period"])
    if spec.outside == "sensor_slip":
        sensors = replace(sensors, slip=(series["start"], series["jump"]))
    if spec.artefacts == "clean":
        return sensors
    per_mille = 1e-3 * facts.peak * 1.3
    if _loop(spec) == "closed" and spec.period > 1e-3:
        sensors = replace(sensors, force=str(rng.choice(["mean", "mean", "point"])))
    sensors = replace(sensors, position_step=min(1e-5, spec.noise) * reach, force_step=per_mille)
    if spec.artefacts == "harsh":
        sensors = replace(
            sensors, jitter=0.03 * spec.period, stamps=str(rng.choice(["true", "nominal"])), stale=0.002, lost=0.002,
            position_delay=rng.uniform(0, 0.1) * spec.period, force_noise=per_mille, speed_noise=1e-3 * facts.speed,
        )  # fmt: skip
    return sensors


def _run_trimmed(rng, spec, machine, excitation, facts, series):
    """Run with all that does not repeat; in open loop the operator trims the bias until the axis stays in place."""
    t, f = excitation.t, machine.coulomb_force
    outer = foreign.wandering(t, spec.dirt * f, 0.1, rng)
    if spec.artefacts != "clean":
        outer += foreign.torque_noise(t, 1e-3 * facts.peak, rng)
    level = np.zeros_like(t)
    if spec.outside == "outer_sine":
        outer += foreign.outer_sine(t, **series) if series else 0.0
    if spec.outside == "outer_pulse" and series:
        outer += foreign.outer_pulse(t, **series)
    if spec.outside == "sticking_bursts" and series:
        span = (series["start"], series["end"])
        level += foreign.bursts(t, series["height"], series["rate"], series["length"], rng, span)
    world = {
        "outer_force": outer,
        "extra_level": level,
        "level_factor": foreign.wandering(t, spec.rough, 3.0, rng) if spec.rough else None,
        "loop_noise": spec.noise * facts.half / 0.2 * 0.1 * rng.standard_normal(len(t)),
        "settled": True,
    }
    try:
        truth = run(machine, excitation, **world)
    except ValueError as error:  # two masses without inertia on both sides, say
        raise UndrawableError(str(error)) from error
    if isinstance(excitation, Torque) and spec.excitation not in ("still", "staircase"):
        truth = _trim(machine, excitation, world, facts, truth)
    _check(spec, truth, facts, excitation)
    return truth


def _drift(truth):
    y, n = truth["position"], len(truth["t"])
    return float(y[-n // 4 :].mean() - y[n // 8 : 3 * n // 8].mean())


def _trim(machine, excitation, world, facts, truth):
    bias, slope, force = 0.0, None, excitation.torque
    for _ in range(6):
        drift = _drift(truth)
        if abs(drift) < 0.25 * facts.half:
            break
        first = -math.copysign(0.05 * machine.coulomb_force, drift)
        probe = first if slope is None else bias - drift / slope
        probe = float(np.clip(probe, -machine.unit_force, machine.unit_force))
        again = run(machine, replace(excitation, torque=force + probe / machine.gain), **world)
        if probe != bias and _drift(again) != drift:
            slope = (_drift(again) - drift) / (probe - bias)
        bias, truth = probe, again
    return truth


def _check(spec, truth, facts, excitation):
    travel = np.ptp(truth["position"])
    if not np.isfinite(truth["position"]).all():
        raise UndrawableError("diverged")
    if spec.excitation == "still":
        return
    if travel > 6 * 2 * facts.half or travel < 0.2 * 2 * facts.half:
        raise UndrawableError(f"travel {travel:.3g} against {2 * facts.half:.3g}")
    if isinstance(excitation, Motion) and np.abs(truth["force_command"]).max() >= 0.999 * excitation.loop.limit:
        raise UndrawableError("the loop shakes")


def _axis(spec, plain, sensors, facts):
    rotary = spec.orientation == "rotary"
    mechanics = {"axis": spec.orientation, "M": plain.M, "J": plain.J, "Rc": plain.Rc, "Rm": plain.Rm, "g": plain.g}
    if plain.force_per_torque is not None:
        mechanics["force_per_torque"] = plain.force_per_torque
    drive = {"rated_torque": facts.peak * 1.3 / plain.gain}
    if sensors.force_step:
        drive["torque_resolution"] = sensors.force_step / plain.gain
    return {
        "name": f"case-{spec.seed:06d}" + ("-r" if rotary else ""),
        "mechanics": mechanics,
        "drive": drive,
        "sensor": {"position_resolution": sensors.position_step, "side": sensors.side},
        "stream": {"sample_time": spec.period, "torque": _words(sensors)},
    }


def write_case(case: Case, folder: Path) -> Path:
    """Write what a user has, axis.toml and one CSV per recording, into `folder`; returns the axis file's path."""
    folder.mkdir(parents=True, exist_ok=True)
    gain = case.plant.gain
    lines = [f'name = "{case.axis["name"]}"']
    for table in ("mechanics", "drive", "sensor", "stream"):
        lines += [f"[{table}]", *(f"{key} = {_toml(value)}" for key, value in case.axis[table].items())]
    for number, entry in enumerate(case.recordings):
        name, columns = f"recording_{number + 1}.csv", dict(entry["columns"])
        force = columns.pop("force")
        table = {"t": columns.pop("t"), "torque": force / gain, **columns}
        header = ",".join(table)
        np.savetxt(folder / name, np.column_stack(list(table.values())), "%.9g", ",", header=header, comments="")
        lines += ["[[recording]]", f'file = "{name}"', f"sample_time = {case.spec.period}", f'loop = "{entry["loop"]}"',
                  f'torque = "{entry["torque"]}"', f'note = "{entry["note"]}"']  # fmt: skip
    path = folder / "axis.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def _toml(value):
    return f'"{value}"' if isinstance(value, str) else repr(float(value))
