"""What happened to one axis over a span, as one HTML page to file or to send: from the history alone."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from monitor.report_body import Body, number, words
from monitor.report_figures import AFTER, BEFORE, show_unit
from monitor.report_trends import charts_figure, curve_figure, trend_figure
from monitor.times import iso, parse_duration

if TYPE_CHECKING:
    from monitor.query_page import PageReader

FIRST = ("friction_at_mid_speed", "coulomb_force", "viscous_coefficient")  # drawn, where they are


def page(reader: PageReader, axis: str, since: str) -> str:
    """The whole page.

    Args:
        reader: of the history.
        axis: its name.
        since: span back from the axis' latest sample, as in 90d.

    Raises:
        QueryError: unknown axis, or a span that is not understood.
    """
    span = parse_duration(since)
    summary = reader.axis(axis).to_dict()
    history = reader.history(axis, since_ns=span)
    watched = reader.watched(axis, since_ns=span)
    curves = reader.curves(axis)
    last = summary["last_sample_ns"]
    first = None if last is None else last - span
    told = reader.transitions(axis, from_ns=first)
    did = [one for one in reader.events(axis) if first is None or one["at_ns"] >= first]
    body = Body(force=curves["force_unit"])
    _head(body, summary, history, since)
    _parameters(body, summary, history)
    if curves["now"]:
        body.section("Friction against speed")
        body.text("Band: where 19 of 20 windows fell while the axis was healthy; and the 95 % interval of the latest.")
        drawn = curve_figure(curves["now"], curves["baseline"], curves["force_unit"], curves["speed_unit"])
        body.figure(drawn, "friction against speed, now and when healthy")
    _trends(body, history, watched, curves["baseline"], _marks(told, did))
    _happened(body, told, did, reader.alerts(axis))
    _quality(body, summary, history)
    _method(body, summary, history)
    return body.document(f"{axis}: the last {since}")


def _head(body: Body, summary: dict[str, Any], history: dict[str, Any], since: str) -> None:
    alarms = summary["alarms"]
    how = ("no answer yet", "insufficient_data") if not summary["latest"] else ("well", "no_mismatch")
    word, kind = ("alarm", "explained") if alarms else how
    standing = ", ".join(f"{words(kind)}: {words(state)}" for kind, state in alarms.items())
    headline = standing.capitalize() or ("No alarm stands" if summary["latest"] else "Nothing was identified yet")
    lead = f"The last {since} up to {(summary['last_sample'] or 'never')[:16].replace('T', ' ')} UTC."
    body.head(f"Axis {summary['axis']}", word, kind, headline, lead)
    cards = []
    latest = summary["latest"]
    if latest and (coulomb := latest["parameters"].get("coulomb_force")):
        cards.append((f"{number(coulomb['value'])} {show_unit(coulomb['unit'])}", "Coulomb friction, latest window"))
    watched = latest["indicators"] if latest else ()
    middle = next((one for one in watched if one["name"] == "friction at mid speed" and one["baseline"]), None)
    if middle is not None:
        cards.append((f"{100 * (middle['value'] / middle['baseline'] - 1):+.1f} %", "mid-speed friction over baseline"))
    cards.append((str(sum(history["verdicts"].values())), "windows answered in this span"))
    missing = sum(gap["missing"] for gap in history["gaps"])
    cards.append((str(missing), "samples missing in this span"))
    body.cards(cards)


def _parameters(body: Body, summary: dict[str, Any], history: dict[str, Any]) -> None:
    """First and latest value of everything that is trended."""
    rows = []
    for name, series in history["series"].items():
        points = series["points"]
        if not points:
            continue
        first, last = points[0], points[-1]
        interval = "not identifiable" if not last["ci95"] else f"{number(last['ci95'][0])} to {number(last['ci95'][1])}"
        change = f"{100 * (last['value'] / first['value'] - 1):+.1f} %" if first["value"] else "–"
        values = (number(first["value"]), number(last["value"]), interval, change)
        rows.append((words(name), *values, show_unit(series["unit"])))
    if not rows:
        verdicts = ", ".join(f"{count} {words(name)}" for name, count in summary["verdicts"].items()) or "none"
        body.text(f"Nothing was identified in this span. Windows so far: {verdicts}.")
        return
    body.section("Parameters, first and latest in this span")
    body.table(("parameter", ">first", ">latest", ">95 % interval", ">change", "unit"), rows)


def _trends(
    body: Body,
    history: dict[str, Any],
    watched: dict[str, Any],
    baseline: dict[str, Any] | None,
    marks: list[tuple[str, str, str]],
) -> None:
    series = {name: history["series"][name] for name in FIRST if history["series"].get(name, {}).get("points")}
    if not series:
        return
    body.section("Trends")
    body.text(
        "With 95 % interval; dashed and shaded: mean of the healthy axis, and where 19 of 20 of its windows fall."
    )
    known = {words(one["name"]): one for one in (baseline or {}).get("indicators", ())}
    for name, one in series.items():
        body.heading(words(name))
        limit = known.get(words(name))
        limits = None if limit is None else (limit["mean"], limit["scatter"])
        body.figure(trend_figure(one, limits, marks), f"{words(name)} over time")
    if watched["charts"]:
        body.heading("Towards an alarm")
        times = [iso(t) or "" for t in watched["t_ns"]]
        body.figure(charts_figure(watched, times), "charts as shares of their alarm threshold, over time")


def _marks(told: list[dict[str, Any]], did: list[dict[str, Any]]) -> list[tuple[str, str, str]]:
    """What is drawn into every trend."""
    raised = [one for one in told if one["transition"]["after"] == "unacknowledged"]
    alarms = [(one["transition"]["at"], f"▲ {words(one['kind'])}", BEFORE) for one in raised]
    return [*alarms, *((one["at"], f"⚒ {one['text'][:24]}", AFTER) for one in did)]


def _happened(body: Body, told: list[dict[str, Any]], did: list[dict[str, Any]], alerts: list[dict[str, Any]]) -> None:
    """Alarms, their audit, maintenance."""
    body.section("Alarms")
    for one in alerts:
        body.heading(f"{words(one['kind'])}: {words(one['state'])}")
        body.text(one["text"])
        body.text(f"Do: {one['recommended_action']}. Likely cause: {one['likely_cause']}.", "note")
    if not alerts:
        body.text("None was ever raised.")
    moved = []
    for one in told:
        step = one["transition"]
        when = step["at"][:16].replace("T", " ")
        moved.append((when, words(one["kind"]), words(step["before"]), words(step["after"]), step["author"]))
    if moved:
        body.table(("when (UTC)", "alarm", "from", "to", "who"), moved)
    body.section("Maintenance")
    rows = [(one["at"][:16].replace("T", " "), words(one["kind"]), one["text"], one["author"]) for one in did]
    if rows:
        body.table(("when (UTC)", "kind", "what", "who"), rows)
    else:
        body.text("Nothing was noted in this span.")


def _quality(body: Body, summary: dict[str, Any], history: dict[str, Any]) -> None:
    body.section("Data quality")
    rows = [("samples received, ever", str(summary["samples"])), ("missing, ever", str(summary["missing"]))]
    rows += [(f"windows in this span: {words(name)}", str(count)) for name, count in history["verdicts"].items()]
    rows += [(f"refused, ever: {words(why)}", str(count)) for why, count in summary["rejected"].items()]
    body.table(("what", ">number"), rows)


def _method(body: Body, summary: dict[str, Any], history: dict[str, Any]) -> None:
    body.section("Method")
    body.text(
        "Every window of the stream is identified by itself: the friction law, the initial state and a latent "
        "disturbance are fitted by one-step prediction. What is watched is compared with the axis' own healthy "
        "windows, at the operating point of each, with thresholds for a stated rate of false alarms."
    )
    latest = summary["latest"] or {}
    digest = hashlib.sha256(json.dumps(history, sort_keys=True).encode()).hexdigest()
    body.text("The hash is of the history this page was drawn from: tribowatch history AXIS --since … --json.", "note")
    body.provenance(digest, latest.get("seed"))
