"""From answers to an axis file: the questions as data, their checks, and what becomes of the answers. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from monitor.axis_guess import ColumnGuess, Constants
from plant.axis import AXIS_NAME, Axis, Drive, Mechanics, Orientation, RecordingEntry, Sensor, Stream, TorqueHold
from plant.axis_schema import CHANNELS
from plant.checks import nearest
from plant.errors import InputError

Answers = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Question:
    """One thing that has to be known.

    Attributes:
        key: of the answer.
        text: as asked.
        unit: of the answer, "" for words.
        default: what an empty answer means; None where an answer is needed.
        check: turns the text typed into a value.
    """

    key: str
    text: str
    unit: str
    default: Any
    check: Callable[[str], Any]

    def read(self, text: str) -> Any:
        """The value of an answer.

        Raises:
            InputError: an answer that cannot be used; names the key, the answer and what is allowed.
        """
        try:
            return self.check(text.strip())
        except ValueError as error:
            unit = f" [{self.unit}]" if self.unit else ""
            raise InputError(f"{self.key}{unit} is {text!r}, but must be {error}") from None


def _number(least: float, *, above: bool = False, empty: bool = False) -> Callable[[str], float | None]:
    wanted = f"a number {'>' if above else '>='} {least:g}" + (", or nothing if unknown" if empty else "")

    def check(text: str) -> float | None:
        if empty and text.lower() in ("", "none", "unknown", "-"):
            return None
        try:
            value = float(text.replace(",", "."))
        except ValueError:
            raise ValueError(wanted) from None
        if not math.isfinite(value) or value < least or (above and value == least):
            raise ValueError(wanted)
        return value

    return check


def _one_of(*words: str) -> Callable[[str], str]:
    def check(text: str) -> str:
        found = [word for word in words if word.startswith(text.lower())] if text else []
        if len(found) != 1:
            raise ValueError(" or ".join(words))
        return found[0]

    return check


def _name(text: str) -> str:
    if not re.fullmatch(AXIS_NAME, text) or text == "alive":
        raise ValueError("1-40 of A-Z a-z 0-9 _ . -, a letter or digit first, and not 'alive'")
    return text


def _range(text: str) -> tuple[float, float] | None:
    if not text or text.lower() in ("none", "unknown", "-"):
        return None
    parts = re.findall(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?", text)
    if len(parts) != 2 or float(parts[0]) >= float(parts[1]):
        raise ValueError("two rising numbers like '0 2', or nothing if unknown")
    return float(parts[0]), float(parts[1])


def _nonzero(text: str) -> float:
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = 0.0
    if value == 0 or not math.isfinite(value):
        raise ValueError("a number other than 0")
    return value


def torque_constant_question(column: str) -> Question:
    """Amperes become N*m by a number of the motor's data sheet."""
    return Question("torque_constant", f"Torque constant ({column} is a current)", "N*m per A", None, _nonzero)


def gain_question() -> Question:
    """Torque becomes force at the belt by the gear and the pulley."""
    return Question("force_per_torque", "Force at the belt per motor torque, 1/Rm", "N per N*m", 1.0, _nonzero)


def first_questions(name: str, orientation: Orientation | None) -> tuple[Question, ...]:
    """What has to be known before anything else."""
    return (
        Question("name", "Name of the axis (it becomes part of the stream's key)", "", name, _name),
        Question(
            "orientation",
            "How does it lie: vertical, horizontal or rotary",
            "",
            str(orientation) if orientation else None,
            _one_of("vertical", "horizontal", "rotary"),
        ),
    )


def questions(orientation: Orientation, guess: Constants | None, *, uses_torque: bool) -> tuple[Question, ...]:
    """The questions that are left, with defaults from a recording where there is one."""
    rotary = orientation is Orientation.ROTARY
    position = "rad" if rotary else "m"
    inertia = guess.inertia if guess else None
    asked = [
        Question("inertia", "Total inertia on the axis", "kg*m^2", inertia, _number(0, above=True))
        if rotary
        else Question("mass", "Mass in translation", "kg", inertia, _number(0, above=True))
    ]
    if not rotary:
        asked.append(
            Question("inertia", "Inertia on the driving pulley's axis, 0 if contained", "kg*m^2", 0.0, _number(0))
        )
        asked.append(Question("pulley_radius", "Radius of the driving pulley", "m", 1.0, _number(0, above=True)))
    if uses_torque:
        asked.append(Question("rated_torque", "Rated torque", "N*m", None, _number(0, above=True, empty=True)))
    else:
        asked.append(Question("rated_force", "Rated force", "N", None, _number(0, above=True, empty=True)))
    asked += [
        Question("travel", "Lowest and highest position", position, guess.travel if guess else None, _range),
        Question("sample_time", "Sample time", "s", guess.sample_time if guess else 0.01, _number(0, above=True)),
        Question("sensor_side", "Where is the position measured: load or motor", "", "load", _one_of("load", "motor")),
    ]
    return tuple(asked)


def known_question(what: str) -> Question:
    """A mass that is believed though it is wrong makes friction wrong and its intervals too narrow to show it."""
    text = f"Is that {what} known (weighed, calculated), or rough (good to a factor of two, then estimated too)"
    return Question("how_known", text, "", "known", _one_of("known", "rough"))


OPTIONAL = ("rated_torque", "rated_force", "travel")


def build_axis(answers: Answers, guess: Constants | None, entry: RecordingEntry | None) -> Axis:
    """Make the axis.

    Args:
        answers: by the keys of the questions; `inertia_known` False where the inertia is only a guess.
        guess: constants from a recording, for what was not asked.
        entry: the recording to list, None without one.

    Raises:
        InputError: a needed answer is missing; names it and the option that gives it.
        ParameterError: values that make no machine.
    """
    orientation = Orientation(_needed(answers, "orientation"))
    rotary = orientation is Orientation.ROTARY
    mechanics = Mechanics(
        orientation=orientation,
        M=0.0 if rotary else _needed(answers, "mass"),
        J=_needed(answers, "inertia") if rotary else answers.get("inertia") or 0.0,
        Rc=1.0 if rotary else answers.get("pulley_radius") or 1.0,
        force_per_torque=answers.get("force_per_torque") or 1.0,
        travel=_with_margin(answers.get("travel")),
        inertia_known=bool(answers.get("inertia_known", True)),
    )
    rated = answers.get("rated_force")
    if answers.get("rated_torque"):
        rated = answers["rated_torque"] * abs(mechanics.gain)
    sample_time = answers.get("sample_time") or (guess.sample_time if guess else None)
    return Axis(
        name=_needed(answers, "name"),
        mechanics=mechanics,
        drive=Drive(rated, guess.force_resolution if guess else 0.0),
        sensor=Sensor(guess.position_resolution if guess else 0.0, answers.get("sensor_side") or "load"),
        stream=Stream(sample_time, TorqueHold.HOLD),
        analysis_sample_time=0.01 if sample_time and sample_time < 0.005 else None,
        recordings=(replace(entry, sample_time=sample_time),) if entry else (),
    )


def _with_margin(travel: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if travel is None or travel[0] >= travel[1] else (float(f"{travel[0]:.4g}"), float(f"{travel[1]:.4g}"))


def _needed(answers: Answers, key: str) -> Any:
    if answers.get(key) is None:
        raise InputError(f"{key.replace('_', ' ')} of the axis is not known; give --{key.replace('_', '-')}")
    return answers[key]


def build_entry(
    file: Path, guess: ColumnGuess, scale: Mapping[str, float], select: Mapping[str, str]
) -> RecordingEntry:
    """The [[recording]] of the axis file: columns that differ from ours, units, and the run chosen."""
    return RecordingEntry(
        file=file.resolve(),
        columns={ours: name for ours, name in guess.columns.items() if ours != name},
        scale={**guess.scale, **scale},
        select=dict(select),
    )


def read_pairs(option: str, pairs: list[str], names: tuple[str, ...] | None = CHANNELS) -> dict[str, str]:
    """Read `name=value` options; `names` are those allowed.

    Raises:
        InputError: no `=`, or another name; says the nearest.
    """
    found = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise InputError(f"{option} is {pair!r}, but must be name=value, like {option} torque=...")
        if names is not None and name.strip() not in names:
            raise InputError(f"{option} names {name.strip()!r}; {nearest(name.strip(), names)}")
        found[name.strip()] = value.strip()
    return found


def read_factors(option: str, pairs: list[str]) -> dict[str, float]:
    """Read `channel=factor` options.

    Raises:
        InputError: as `read_pairs`, or a factor that is no number other than 0.
    """
    found = {}
    for name, text in read_pairs(option, pairs).items():
        try:
            found[name] = _nonzero(text)
        except ValueError as error:
            raise InputError(f"{option} {name} is {text!r}, but must be {error}") from None
    return found


def name_from(path: Path | None) -> str:
    """A name for the axis from its recording's file."""
    stem = path.name.split(".")[0] if path else "axis-0001"
    cleaned = re.sub(r"[^A-Za-z0-9_.-]+", "-", stem).strip("-_.")[:40]
    return cleaned if re.fullmatch(AXIS_NAME, cleaned) and cleaned != "alive" else "axis-0001"
