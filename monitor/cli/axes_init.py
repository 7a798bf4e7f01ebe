"""`tribowatch axes init`: an axis file from questions or from a recording, and whether the two agree."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from monitor.cli.options import AsJson
from plant.errors import InputError, RecordingError

if TYPE_CHECKING:
    from identify.audit import Finding
    from identify.suitability import Suitability
    from monitor.axis_guess import ColumnGuess, Constants
    from monitor.axis_wizard import Question
    from plant.axis import Axis, RecordingEntry
    from plant.recording import Recording

Pairs = list[str] | None


def axes_init_command(
    recording: Annotated[
        Path | None, typer.Option(help="A recording of the axis: columns and constants are guessed from it.")
    ] = None,
    out: Annotated[Path, typer.Option(help="The axis file to write.")] = Path("axis.toml"),
    name: Annotated[str | None, typer.Option(help="Name of the axis.", show_default=False)] = None,
    orientation: Annotated[str | None, typer.Option(help="vertical, horizontal or rotary.", show_default=False)] = None,
    mass: Annotated[float | None, typer.Option(help="Mass in translation, in kg.", show_default=False)] = None,
    inertia: Annotated[
        float | None,
        typer.Option(help="Inertia on the driving pulley's (or rotary) axis, in kg*m^2.", show_default=False),
    ] = None,
    mass_known: Annotated[
        bool | None,
        typer.Option(
            "--mass-known/--mass-rough",
            help="Was the mass (rotary: the inertia) weighed or calculated, or is it good to a factor of two? A rough "
            "one is estimated with the friction. Default: known if given, rough if guessed from the recording.",
            show_default=False,
        ),
    ] = None,
    pulley_radius: Annotated[
        float | None, typer.Option(help="Radius of the driving pulley, in m.", show_default=False)
    ] = None,
    force_per_torque: Annotated[
        float | None, typer.Option(help="Force at the belt per motor torque, in N per N*m.", show_default=False)
    ] = None,
    rated_torque: Annotated[float | None, typer.Option(help="Rated torque, in N*m.", show_default=False)] = None,
    rated_force: Annotated[float | None, typer.Option(help="Rated force, in N.", show_default=False)] = None,
    column: Annotated[
        Pairs, typer.Option(help="Column of the file for a channel: --column t=time_s. Repeatable.", show_default=False)
    ] = None,
    scale: Annotated[
        Pairs, typer.Option(help="Factor file unit to SI: --scale torque=0.0934. Repeatable.", show_default=False)
    ] = None,
    select: Annotated[
        Pairs, typer.Option(help="Rows of a file with many runs: --select run=0m20. Repeatable.", show_default=False)
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Ask nothing; take what is given or guessed.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an axis file that exists.")] = False,
    as_json: AsJson = False,
) -> None:
    """Build an axis file from questions or a recording; check sign, unit and scale, and what the motion is worth."""
    if out.exists() and not force:
        raise InputError(f"{out} exists; give another --out, or --force to overwrite it")
    given = {
        "name": name, "orientation": orientation, "mass": mass, "inertia": inertia, "pulley_radius": pulley_radius,
        "force_per_torque": force_per_torque, "rated_torque": rated_torque, "rated_force": rated_force,
    }  # fmt: skip
    asker = _Asker({key: value for key, value in given.items() if value is not None}, silent=yes)
    columns = _columns(recording, column or [], scale or [], select or [], asker) if recording else None
    axis, guessed = _describe(asker, columns, recording, mass_known)
    from plant.axis_file import read_axis, write_axis

    write_axis(axis, out)
    axis = read_axis(out)
    judged = judge(axis, columns.entry if columns else None)
    _show(out, axis, guessed, judged, as_json)


class _Asker:
    """Answers: given on the command line, else asked, else the default."""

    def __init__(self, given: dict[str, Any], *, silent: bool) -> None:
        self.answers = given
        self.guessed: dict[str, Any] = {}
        self.silent = silent

    def ask(self, question: Question) -> Any:
        """The answer to `question`, remembered."""
        key = question.key
        if key in self.answers:
            self.answers[key] = question.read(str(self.answers[key]))
        else:
            self.answers[key] = question.default if self.silent else self._prompt(question)
            if question.default is not None and self.answers[key] == question.default:
                self.guessed[key] = question.default
        return self.answers[key]

    def _prompt(self, question: Question) -> Any:
        """Ask until the answer can be used; the prompt goes to stderr."""
        from monitor.axis_wizard import OPTIONAL
        from monitor.cli.output import note

        unit = f" [{question.unit}]" if question.unit else ""
        default = question.default
        shown = f"{default[0]:g} {default[1]:g}" if isinstance(default, tuple) else default
        if shown is None and question.key in OPTIONAL:
            shown = "unknown"
        while True:
            text = str(typer.prompt(f"{question.text}{unit}", default=shown, err=True))
            try:
                return question.read(text)
            except InputError as error:
                note(str(error))


@dataclass(frozen=True, slots=True)
class _Columns:
    """The recording as it can be read: its entry, the guess behind it, gain, and the samples in SI."""

    entry: RecordingEntry
    guess: ColumnGuess
    samples: Recording
    constants: Constants


def _columns(path: Path, column: list[str], scale: list[str], select: list[str], asker: _Asker) -> _Columns:
    """Find the channels of the file, their units, and what they say of the axis."""
    from dataclasses import replace

    from monitor import axis_guess, axis_wizard
    from plant.axis import Orientation
    from plant.recording_files import read_recording_entry
    from plant.table_files import column_names

    names = column_names(path)
    guess = axis_guess.guess_columns(names, axis_wizard.read_pairs("--column", column))
    factors = axis_wizard.read_factors("--scale", scale)
    if guess.current and "torque" not in factors:
        constant = asker.ask(axis_wizard.torque_constant_question(guess.columns["torque"]))
        if constant is None:
            raise InputError(
                f"{path}: column {guess.columns['torque']!r} is a current; give its torque constant in N*m per A: "
                "--scale torque=..."
            )
        factors["torque"] = constant
    entry = axis_wizard.build_entry(path, guess, factors, axis_wizard.read_pairs("--select", select, None))
    said = asker.answers.get("orientation")
    rotary = guess.rotary if said is None else str(said).startswith("r")
    torque = "torque" in guess.columns
    gain = asker.ask(axis_wizard.gain_question()) if torque and not rotary else 1.0
    plain = axis_guess.plain_axis(rotary, gain)
    samples = read_recording_entry(entry, plain)
    if "t" not in entry.scale and (unit := axis_guess.guess_time_scale(samples)) != 1.0:
        entry = replace(entry, scale={**entry.scale, "t": unit})
        samples = read_recording_entry(entry, plain)
    if len(samples) < 2:
        raise RecordingError(f"{path}: one sample only; nothing can be guessed from it")
    _hint_at_runs(samples, entry, [name for name in names if name not in guess.columns.values()])
    constants = axis_guess.guess_constants(samples, rotary=rotary)
    if said is not None:
        orientation = Orientation(axis_wizard.first_questions("a", None)[1].read(str(said)))
        constants = replace(constants, orientation=orientation)
    return _Columns(entry, guess, samples, constants)


def _hint_at_runs(samples: Recording, entry: RecordingEntry, others: list[str]) -> None:
    """Say on stderr that a file probably holds many runs: time starts anew."""
    import numpy as np

    from monitor.cli.output import note

    back = int(np.count_nonzero(np.diff(samples.t) < 0))
    if back and not entry.select:
        note(
            f"{entry.file}: time runs backwards {back} times; if the file holds several runs, choose one with --select "
            f"COLUMN=VALUE (columns: {', '.join(others)})"
        )


def _describe(
    asker: _Asker, columns: _Columns | None, path: Path | None, mass_known: bool | None
) -> tuple[Axis, dict[str, Any]]:
    """Ask what is left and make the axis; also what was only guessed. `mass_known` None: known where it was given."""
    from monitor import axis_wizard
    from plant.axis import Orientation

    constants = columns.constants if columns else None
    for question in axis_wizard.first_questions(
        axis_wizard.name_from(path), constants.orientation if constants else None
    ):
        asker.ask(question)
    lies = asker.answers["orientation"]
    if lies is None:
        raise InputError("orientation of the axis is not known; give --orientation vertical, horizontal or rotary")
    uses_torque = "torque" in columns.guess.columns if columns else asker.answers.get("rated_force") is None
    if uses_torque and columns is None and lies != "rotary":
        asker.ask(axis_wizard.gain_question())
    for question in axis_wizard.questions(Orientation(lies), constants, uses_torque=uses_torque):
        asker.ask(question)
    key = "inertia" if lies == "rotary" else "mass"
    if mass_known is None:
        guessed = constants is not None and key in asker.guessed
        mass_known = not guessed and (asker.silent or asker.ask(axis_wizard.known_question(key)) == "known")
    asker.answers["inertia_known"] = mass_known
    axis = axis_wizard.build_axis(asker.answers, constants, columns.entry if columns else None)
    return axis, dict(asker.guessed)


@dataclass(frozen=True, slots=True)
class Judged:
    """What the audit and the suitability say of one recording."""

    findings: tuple[Finding, ...]
    suitability: Suitability


def judge(axis: Axis, entry: RecordingEntry | None) -> Judged | None:
    """Check the recording against the axis file as written; None without a recording."""
    from plant.recording_files import read_recording_entry

    if entry is None:
        return None
    samples = read_recording_entry(axis.recordings[0], axis)
    return judged_by(samples, axis)


def judged_by(samples: Recording, axis: Axis) -> Judged:
    """Audit, mass and suitability of samples, the gravest finding first."""
    from identify.audit import audit_recording, worst
    from identify.audit_mass import doubted_mass
    from identify.suitability import suitability

    found, doubt = audit_recording(samples, axis), doubted_mass(samples, axis)
    if doubt is not None and worst(found) != "refuse":  # with a wrong sign or unit, the mass is the least of it
        found = (doubt, *(one for one in found if one.check != "inertia"))
    return Judged(found, suitability(samples, axis))


def judged_to_dict(judged: Judged | None) -> dict[str, Any]:
    """The judgement as JSON."""
    if judged is None:
        return {"audit": None, "findings": [], "suitability": None}
    from identify.audit import worst

    return {
        "audit": worst(judged.findings),
        "findings": [finding.to_dict() for finding in judged.findings],
        "suitability": judged.suitability.to_dict(),
    }


def show_judged(judged: Judged) -> None:
    """Print the findings, worst first, and the verdict on the motion."""
    from monitor.cli.output import screen

    out = screen()
    for finding in judged.findings:
        out.print(f"  {finding.severity:6} {finding.check}: {finding.text}")
    out.print(judged.suitability.text)


def _show(out: Path, axis: Axis, guessed: dict[str, Any], judged: Judged | None, as_json: bool) -> None:
    """Print what was written and how it fits."""
    if as_json:
        from monitor.cli.output import emit_json

        emit_json({"axis_file": str(out), "axis": axis.name, "guessed": guessed, **judged_to_dict(judged)})
        return
    from monitor.cli.output import screen

    screen().print(f"{out}: axis {axis.name} written")
    if guessed:
        screen().print("  taken as default or guessed, check them in the file: " + ", ".join(guessed))
    if "force_per_torque" in guessed:
        screen().print(
            f"  force_per_torque is {axis.mechanics.gain:g} N per N*m by default; every newton scales with it: "
            "give --force-per-torque"
        )
    if judged is not None:
        show_judged(judged)
        screen().print(f"next: tribowatch identify --axis {out}")
