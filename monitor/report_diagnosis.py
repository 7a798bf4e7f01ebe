"""A diagnosis as one HTML page to forward: what is left out, why we think so, what else it could be. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from monitor import report_figures as figures
from monitor.report_body import WORDY, Body, number, recordings_section, shown_quantity, words
from monitor.report_figures import show_unit
from monitor.report_heat import READING, grid_figure, grid_words

if TYPE_CHECKING:
    from identify.mismatch.pictures import Pictures
    from identify.mismatch.result import Change, Diagnosis, Location
    from plant.axis import Axis
    from plant.recording import Recording

HEADLINES = {
    "no_mismatch": "Nothing is missing from the model that these recordings could show",
    "unexplained": "Something is left that no effect of the catalogue explains",
    "insufficient_data": "These recordings cannot tell",
}


def page(found: Diagnosis, axis: Axis, recordings: Sequence[Recording]) -> str:
    """The whole page."""
    body = Body(axis.position_unit, axis.force_unit)
    _head(body, found)
    if found.effects:
        _parameters(body, found)
    if found.pictures is not None:
        _evidence(body, found, found.pictures)
        _proof(body, found, found.pictures)
    if found.detectable:
        _hidden(body, found)
    if found.pictures is not None:
        _rivals(body, found, found.pictures)
        _friction(body, found.pictures)
    if found.changes:
        _changes(body, found)
    if found.next_experiment:
        body.section("Next experiment")
        body.text(f"To settle the rest: {found.next_experiment}.")
        _experiments(body, found)
    if found.pictures is not None:
        _limits(body, found)
    _provenance(body, found, recordings)
    return body.document(f"{found.axis}: {words(found.verdict.value)}")


def _head(body: Body, found: Diagnosis) -> None:
    """Verdict, the sentence, and the numbers one looks for first."""
    verdict = found.verdict.value
    names = " and ".join(words(effect.name) for effect in found.effects)
    headline = f"The model leaves out: {names}" if names else HEADLINES[verdict]
    lead = show_unit(words(found.explanation))
    body.head(f"Diagnosis of axis {found.axis}", words(verdict), verdict, headline, lead)
    shown: list[tuple[str, str]] = []
    if found.fit and found.effects:
        before, after = found.fit["baseline"].held_out, found.fit["extended"].held_out
        if before and after is not None:
            shown.append((f"{100 * after / before:.0f} %", "of the squared one-second error on unseen data remains"))
    if found.remaining_force is not None:
        unit = show_unit(found.remaining_force.unit)
        shown.append((f"{found.remaining_force.value:.2g} {unit}", "force that stays unexplained"))
    if found.location is not None:
        shown.append((_place(found.location, body.length), f"where it shows: {words(found.location.coordinate)}"))
    if found.effects:
        others = len(found.alternatives) - 1
        shown.append((str(max(others, 0)), "other explanations these data cannot rule out"))
    body.cards(shown)


def _place(location: Location, length: str) -> str:
    """The interval of a location with its unit."""
    from identify.mismatch.maps import unit_of

    low, high = location.interval
    unit = show_unit(unit_of(location.coordinate, length))
    return "both directions" if location.coordinate == "direction" else f"{low:.3g} to {high:.3g} {unit}"


def _parameters(body: Body, found: Diagnosis) -> None:
    """What was left out, how big."""
    from identify.mismatch.words import PLAIN

    body.section("What is left out, and how big it is")
    rows = []
    for effect in found.effects:
        for index, (name, quantity) in enumerate(effect.parameters.items()):
            first = (words(effect.name), f"{100 * effect.share:.0f} %", f"{effect.force_rms:.2g}")
            rows.append((*(first if index == 0 else ("", "", "")), words(name), *shown_quantity(quantity)))
    force = show_unit(body.force)
    body.table(
        ("effect", ">share of residual", f">force, rms [{force}]", "parameter", ">value", ">95 % interval", "unit"),
        rows,
    )
    body.items(f"{words(one.name)}: {PLAIN[one.name]}" for one in found.effects if one.name in PLAIN)


def _evidence(body: Body, found: Diagnosis, pictures: Pictures) -> None:
    """Residual force along coordinates, and where the evidence accrues."""
    body.section("Evidence: the force the model does not explain")
    after = " With the effect in the model it should be flat." if found.effects else ""
    body.text(
        "Drive force minus what the model needs for the recorded motion, averaged along a coordinate over all "
        f"recordings. The even half pushes the same way in both directions; the odd half is friction.{after}"
    )
    body.text(
        "Near standstill the low-pass blurs the turn of friction: what all models leave there alike is no evidence.",
        "note",
    )
    if not pictures.maps:
        body.text("With the sensor at the motor of a soft transmission the force cannot be read back from the motion.")
    if pictures.grids:
        body.text(READING, "note")
    for grid in pictures.grids:
        body.heading(grid_words(grid))
        body.figure(grid_figure(grid, body.force, found.location), f"residual force over position and {grid.other}")
    for coordinate, drawn in figures.pictures_figures(pictures, found.location):
        body.heading(f"Along {words(coordinate)}")
        body.figure(drawn, f"residual force along {words(coordinate)}")
    if pictures.accrual is not None:
        body.heading("How the evidence builds up")
        body.text("Evidence that comes from everywhere climbs steadily; a single step would be a single event.")
        body.figure(figures.accrual_figure(pictures.accrual, pictures.position_unit), "log-likelihood gained over time")


def _proof(body: Body, found: Diagnosis, pictures: Pictures) -> None:
    """Predictions of data the fit has not seen."""
    body.section("Proof: data the fit has not seen" if found.effects else "Predictions of data the fit has not seen")
    kind = "the last recording" if found.held_out_kind == "recording" else "40 % of the time"
    body.text(
        f"Free runs of {found.run_length:g} s from the measured state over {kind}; criterion: squared error over the "
        "variance of the position, eq. (4). Force error: root mean square of the residual force over that of the drive."
    )
    models = ("baseline", "extended") if pictures.prediction.after is not None else ("baseline",)
    rows = [
        (model, number(pair.train), number(pair.held_out), number(error.train), number(error.held_out))
        for model in models
        for pair, error in [(found.fit[model], found.force_error[model])]
    ]
    body.table(("model", ">fitted [1]", ">unseen [1]", ">force error, fitted [%]", ">unseen [%]"), rows)
    body.figure(
        figures.prediction_figure(pictures.prediction, pictures.position_unit), "one-second predictions of unseen data"
    )


def _hidden(body: Body, found: Diagnosis) -> None:
    """What could still be there."""
    body.section("What could still hide")
    body.text("Smallest size of each effect that these recordings would have named nine times of ten.")
    remaining = 0.0 if found.remaining_force is None else found.remaining_force.value
    body.figure(figures.hidden_figure(found.detectable, remaining, body.force), "detectable force per effect")
    force = f">force, rms [{show_unit(body.force)}]"
    rows = [
        (words(name), number(one.value, 3), show_unit(one.unit), number(one.force_rms, 2))
        for name, one in sorted(found.detectable.items())
    ]
    body.table(("effect", ">seen from", "unit", force), rows)
    if found.pictures is not None:
        rest = sorted({*found.pictures.screened, *(one.name for one in found.pictures.tried)} - set(found.detectable))
        if rest:
            body.text(f"Not to be seen in this motion at any plausible size: {', '.join(map(words, rest))}.", "note")


def _rivals(body: Body, found: Diagnosis, pictures: Pictures) -> None:
    """What else was tried, and why it was refused."""
    body.section("Rivals, and what was tried")
    if len(found.alternatives) > 1:
        body.text("These recordings cannot tell the answer from:")
        body.items(" with ".join(map(words, names)) for names in found.alternatives[1:])
    elif found.effects:
        body.text("No other name of the catalogue explains these recordings as well.")
    rows, marked = [], []
    for index, one in enumerate(pictures.tried):
        fitted = one.force_rms > 0
        rest = (number(one.z, 2), number(one.free_run, 2), number(one.force_rms, 2)) if fitted else ("–", "–", "–")
        rows.append((str(one.stage), words(one.name), f"{one.evidence:.0f}", *rest, one.outcome))
        if one.outcome == "named":
            marked.append(index)
    if rows:
        force = f">force [{show_unit(pictures.force_unit)}]"
        body.table(("step", "effect", ">evidence", ">z", ">one-second error", force, WORDY), rows, marked)
        body.text(
            "Evidence: fall of the Bayes information criterion against the model of the step before (a name needs 25). "
            "z: agreement of twenty blocks of the recording. One-second error: squared, with over without the effect. "
            "Dashes: a first look already promised too little for a full fit.",
            "note",
        )
    if pictures.screened:
        listed = ", ".join(map(words, pictures.screened))
        body.text(f"Looked at and not fitted, for their response matched nothing that is left: {listed}.", "note")


def _experiments(body: Body, found: Diagnosis) -> None:
    """Small changes of the motion that were simulated for the tied names, and what each would tell."""
    rows = [(one.motion.words, *(f"{value:.0f}" for _, value in one.told)) for one in found.experiments]
    others = [" with ".join(map(words, names)) for names, _ in found.experiments[0].told]
    body.table(("change of the motion", *(f">from {name}" for name in others)), rows)
    body.text(
        "Each was simulated for every rival with its fitted parameters. The numbers: predicted fall of the Bayes "
        "information criterion between the answer and that rival; 90 tell two names apart nine times of ten.",
        "note",
    )


def _friction(body: Body, pictures: Pictures) -> None:
    """The friction law with and without the effects."""
    body.section("Friction law")
    header, rows = ["parameter"], []
    for model in pictures.friction:
        header += [f">{model}", ">95 % interval"]
    for name in pictures.friction["baseline"]:
        values = [shown_quantity(fitted[name]) for fitted in pictures.friction.values()]
        rows.append((words(name), *(cell for value in values for cell in value[:2]), values[0][2]))
    body.table((*header, "unit"), rows)


def _changes(body: Body, found: Diagnosis) -> None:
    """What differs between commissioning and today."""
    body.section("Changed since commissioning")
    rows = []
    for change in found.changes:
        interval = f"{change.ci95[0]:.3g} to {change.ci95[1]:.3g}"
        rows.append((_changed(change), number(change.before), number(change.after), interval, show_unit(change.unit)))
    body.table(("parameter", ">before", ">today", ">change, 95 % interval", "unit"), rows)


def _changed(change: Change) -> str:
    """What changed, and how where it is an effect."""
    name = words(change.parameter)
    return name if change.effect is None else f"{words(change.effect)}, {name}: {change.kind}"


def _limits(body: Body, found: Diagnosis) -> None:
    """What the reader must not conclude."""
    from identify.mismatch.words import LIMITS

    body.section("Limits")
    body.items(LIMITS)
    if found.preprocessing:
        body.text("Preparation of the data:")
        body.items(found.preprocessing)


def _provenance(body: Body, found: Diagnosis, recordings: Sequence[Recording]) -> None:
    """Method, data, versions, seed."""
    body.section("Data and method")
    recordings_section(body, recordings)
    body.text(
        "Rigid mass with Coulomb, static, Stribeck and viscous friction, fitted by one-step prediction with a "
        "disturbance observer; every effect of the catalogue is then tried on top of it. An effect is named where "
        "evidence, agreement over the recording, size, bounds, and predictions of unseen data all speak for it."
    )
    body.provenance(found.data_sha256, found.seed)
