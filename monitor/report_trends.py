"""Figures of friction itself: against speed, over time with control limits. Plotly's JSON, no plotly. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from monitor.report_figures import AFTER, BEFORE, MEASURED, Figure, bare, show_unit

BAND = {BEFORE: "rgba(213, 94, 0, 0.22)", AFTER: "rgba(46, 139, 192, 0.22)"}  # paler, for intervals
COLOURS = (AFTER, BEFORE, "#009E73", "#CC79A7", MEASURED, "#B58900")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")
Curve = Mapping[str, Any]


def band(x: Sequence[Any], low: Sequence[Any], high: Sequence[Any], colour: str, name: str) -> Figure:
    """A filled interval."""
    return {
        "type": "scatter", "mode": "lines", "x": [*x, *reversed(x)], "y": [*high, *reversed(low)], "fill": "toself",
        "fillcolor": BAND[colour], "line": {"width": 0}, "hoverinfo": "skip", "showlegend": False, "legendgroup": name,
    }  # fmt: skip


def line(x: Sequence[Any], y: Sequence[Any], colour: str, name: str, **more: Any) -> Figure:
    """A line."""
    style = {"color": colour, "width": 2.0, **more.pop("line", {})}
    drawn = {"type": "scatter", "mode": "lines", "x": list(x), "y": list(y), "name": name, "legendgroup": name}
    return {**drawn, "line": style, **more}


def curve_figure(now: Curve | None, baseline: Curve | None, force_unit: str, speed_unit: str) -> Figure:
    """Friction against speed: now, and where a healthy window falls.

    Args:
        now: `speeds`, `values`, `low`, `high`.
        baseline: the same, None while it is learned.
        force_unit: of the values.
        speed_unit: of the speeds.
    """
    layout = bare(340)
    layout["xaxis"] = {"title": {"text": f"speed [{show_unit(speed_unit)}]"}, "rangemode": "tozero"}
    layout["yaxis"] = {"title": {"text": f"friction [{show_unit(force_unit)}]"}, "rangemode": "tozero"}
    data: list[Figure] = []
    for curve, colour, name in ((baseline, AFTER, "healthy"), (now, BEFORE, "now")):
        if curve is not None:
            data += [band(curve["speeds"], curve["low"], curve["high"], colour, name)]
            data += [line(curve["speeds"], curve["values"], colour, name)]
    return {"data": data, "layout": layout}


def trend_figure(
    series: Mapping[str, Any], limits: tuple[float, float] | None, marks: Sequence[tuple[str, str, str]]
) -> Figure:
    """One number over time with its 95 % interval, control limits and what happened.

    Args:
        series: `unit` and `points` of the history.
        limits: mean and scatter of a healthy window, None where it is not watched.
        marks: time, word, colour of alarms and maintenance.
    """
    layout = bare(260)
    layout["showlegend"] = False
    layout["yaxis"] = {"title": {"text": show_unit(series["unit"])}}
    layout["xaxis"] = {"type": "date"}
    points = series["points"]
    times = [one["t"] for one in points]
    sure = [one for one in points if one["ci95"]]
    data = []
    if sure:
        low, high = ([one["ci95"][side] for one in sure] for side in (0, 1))
        data.append(band([one["t"] for one in sure], low, high, BEFORE, "now"))
    data.append(line(times, [one["value"] for one in points], BEFORE, "now"))
    layout["shapes"] = [] if limits is None else _limits(*limits)
    for at, word, colour in marks:
        layout["shapes"].append(
            {"type": "line", "x0": at, "x1": at, "yref": "paper", "y0": 0, "y1": 1}
            | {"line": {"color": colour, "width": 1.2, "dash": "dot"}}
        )
        layout["annotations"].append(
            {"x": at, "yref": "paper", "y": 1, "yanchor": "bottom", "xanchor": "left", "text": word, "showarrow": False}
        )
    return {"data": data, "layout": layout}


def _limits(mean: float, scatter: float) -> list[Figure]:
    """Where 19 of 20 healthy windows fall, and their mean."""
    across = {"xref": "paper", "x0": 0, "x1": 1, "yref": "y", "layer": "below"}
    half = 1.96 * scatter
    shade = {"type": "rect", "y0": mean - half, "y1": mean + half, "fillcolor": BAND[AFTER], "line": {"width": 0}}
    middle = {"type": "line", "y0": mean, "y1": mean, "line": {"color": AFTER, "width": 1.5, "dash": "dash"}}
    return [across | shade, across | middle]


def charts_figure(watched: Mapping[str, Any], times: Sequence[str]) -> Figure:
    """How far each chart has come towards its alarm threshold, over time."""
    layout = bare(280)
    layout["yaxis"] = {"title": {"text": "share of the threshold"}, "tickformat": ".0%", "rangemode": "tozero"}
    layout["xaxis"] = {"type": "date"}
    layout["shapes"] = [
        {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": "y", "y0": 1, "y1": 1}
        | {"line": {"color": BEFORE, "width": 1.5, "dash": "dash"}}
    ]
    data = [
        line(
            times,
            [None if up is None else max(up, down) for up, down in zip(chart["up"], chart["down"], strict=True)],
            COLOURS[number % len(COLOURS)],
            name,
            line={"width": 1.5, "dash": DASHES[number % len(DASHES)]},
        )
        for number, (name, chart) in enumerate(watched["charts"].items())
    ]
    return {"data": data, "layout": layout}
