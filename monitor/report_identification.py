"""An identification as one HTML page: the numbers with their intervals, the friction curve, the proof. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identify.one_second import one_second_ahead
from monitor import report_figures as figures
from monitor.report_body import Body, number, recordings_section, shown_quantity, words
from monitor.report_figures import show_unit
from monitor.report_trends import curve_figure

if TYPE_CHECKING:
    from identify.result import IdentificationResult
    from plant.axis import Axis
    from plant.recording import Recording

SHARES = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)  # of the fastest speed, in the table
SPEEDS = 120  # points of the curve
HEADLINES = {
    "identified": "Friction identified",
    "not_informative": "This recording does not tell friction apart",
    "bad_data": "These samples cannot be used",
}
COLOURS = {"identified": "no_mismatch", "not_informative": "unexplained", "bad_data": "explained"}  # of the badge
METHODS = {
    "ga+polish": "A genetic search starts, least squares finish: the friction law, the initial state and a latent "
    "disturbance force are fitted to the motion by one-step prediction. The 95 % intervals come from the scatter of "
    "what each block of the recording moves the answer by; the criterion is eq. (4) over free runs of one second.",
    "paper": "The paper's own genetic algorithm on eq. (4), one free run over the whole recording, binary coding, "
    "Fig. 5. It gives no intervals.",
}


def page(found: IdentificationResult, axis: Axis, recording: Recording) -> str:
    """The whole page."""
    body = Body(axis.position_unit, axis.force_unit)
    _head(body, found)
    if found.parameters:
        _parameters(body, found)
    if found.curve is not None:
        _curve(body, found, f"{axis.position_unit}/s")
    ahead = one_second_ahead(recording, axis, found) if found.parameters else None
    if ahead is not None:
        from identify.mismatch.pictures import Prediction

        body.section("Proof: one second ahead")
        body.text("Free runs of one second from the measured state, with the identified law, over the same recording.")
        seen = Prediction(ahead.t, ahead.run, ahead.position, ahead.error, None)
        body.figure(
            figures.prediction_figure(seen, body.length, "time", "predicted"), "one-second predictions and their errors"
        )
    body.section("Data and method")
    recordings_section(body, [recording])
    if found.preprocessing:
        body.text("Preparation of the data:")
        body.items(found.preprocessing)
    body.text(METHODS.get(found.method, found.method))
    body.provenance(recording.sha256(), found.seed)
    return body.document(f"{found.axis}: {words(found.verdict.value)}")


def _head(body: Body, found: IdentificationResult) -> None:
    """Verdict, reason, the numbers one looks for first."""
    verdict = found.verdict.value
    said = found.reason or (
        f"{found.samples} samples from {found.start:g} s to {found.end:g} s tell friction over the whole range of "
        "speeds that was visited."
    )
    body.head(f"Friction of axis {found.axis}", words(verdict), COLOURS[verdict], HEADLINES[verdict], said)
    cards = []
    if (coulomb := found.parameters.get("coulomb_force")) is not None:
        value, interval, unit = shown_quantity(coulomb)
        cards.append((f"{value} {unit}", f"Coulomb friction, 95 %: {interval}"))
    if found.held_out_criterion is not None:
        cards.append((number(found.held_out_criterion, 2), "criterion on data that were not fitted [1]"))
    if found.latent_force is not None:
        unit = show_unit(body.force)
        cards.append((f"{number(found.latent_force, 2)} {unit}", "force the model leaves unexplained"))
    cards.append((str(found.evaluations), "simulations spent"))
    body.cards(cards)


def _parameters(body: Body, found: IdentificationResult) -> None:
    """Every parameter with its interval."""
    body.section("Parameters")
    rows = []
    for name, one in found.parameters.items():
        value, interval, unit = shown_quantity(one)
        rows.append((words(name), value, interval, unit, "at its bound" if one.at_bound else ""))
    body.table(("parameter", ">value", ">95 % interval", "unit", ""), rows)


def _curve(body: Body, found: IdentificationResult, speed_unit: str) -> None:
    """Friction against speed: known far better than the parameters one by one."""
    assert found.curve is not None
    body.section("Friction against speed")
    body.text("Both directions together. The curve is known far better than its parameters, which trade off.")
    speeds = np.linspace(0.02, 1.0, SPEEDS) * found.curve.fastest
    force, half = found.curve_at(speeds)
    curve = {"speeds": speeds.tolist(), "values": force.tolist()}
    curve |= {"low": (force - half).tolist(), "high": (force + half).tolist()}
    body.figure(curve_figure(curve, None, body.force, speed_unit), "friction against speed with its 95 % interval")
    at = np.array(SHARES) * found.curve.fastest
    values, halves = found.curve_at(at)
    rows = [
        (number(float(v), 3), number(float(f)), f"± {number(float(h), 2)}")
        for v, f, h in zip(at, values, halves, strict=True)
    ]
    body.table((f">speed [{show_unit(speed_unit)}]", f">friction [{show_unit(body.force)}]", ">95 %"), rows)
