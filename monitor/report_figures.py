"""Figures of a diagnosis report as plotly's JSON: data and layout, no plotly import. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from identify.mismatch.maps import Halves, Map
    from identify.mismatch.pictures import Accrual, Pictures, Prediction
    from identify.mismatch.result import Hidden, Location
    from plant.recording import Recording

Floats = NDArray[np.float64]
Figure = dict[str, Any]

BEFORE, AFTER, MEASURED = "#D55E00", "#2E8BC0", "#8A8F98"  # colour-blind safe, seen on white and on black
SHADE = "rgba(140, 140, 140, 0.22)"
MOST_POINTS = 1500  # of a recording
PLACE = 0.8  # of what is drawn: a longer stretch is no place
APART = 20.0  # times the step between samples: a longer one is a gap, over which no line is drawn
WIDE = 80  # px at the left of a figure, for the ticks and the title of its axis


def map_figure(drawn: Map, force_unit: str, location: Location | None) -> Figure:
    """Residual force along one coordinate: a panel per half, baseline and extended model in each."""
    panels = [("same both ways (even half)", "even"), ("flips with direction (odd half)", "odd")]
    if drawn.coordinate == "time":
        panels.append(("rms", "rms"))
    layout = columns(len(panels))
    title = axis_title(drawn.coordinate, drawn.unit)
    data: list[Figure] = []
    models: list[tuple[str, str, Halves | None]] = [
        ("baseline", BEFORE, drawn.before),
        ("extended", AFTER, drawn.after),
    ]
    for number, (heading, half) in enumerate(panels, 1):
        for model, colour, halves in models:
            if halves is not None:
                width = 1.6 if model == "baseline" else 2.2
                line = trace(drawn.middle, getattr(halves, half), model, colour, number, width=width)
                data.append({**line, "showlegend": number == 1, "legendgroup": model})
        layout[axis("xaxis", number)]["title"] = {"text": title}
        layout["annotations"].append(above(heading, number))
    layout["yaxis"]["title"] = {"text": f"residual force [{show_unit(force_unit)}]"}
    span = drawn.middle[[0, -1]]
    low, high = (0.0, 0.0) if location is None else location.interval
    if location is not None and location.coordinate == drawn.coordinate and high - low < PLACE * np.ptp(span):
        layout["shapes"] = [
            {"type": "rect", "x0": low, "x1": high, "y0": 0, "y1": 1, "layer": "below", "line": {"width": 0}}
            | {"xref": f"x{'' if number == 1 else number}", "fillcolor": SHADE}
            | {"yref": f"y{'' if number == 1 else number} domain"}
            for number in range(1, len(panels) + 1)
        ]
        for number in range(1, len(panels) + 1):
            layout[axis("xaxis", number)]["range"] = [float(span[0]), float(span[1])]
    return {"data": data, "layout": layout}


def accrual_figure(accrual: Accrual, unit: str) -> Figure:
    """Log-likelihood gained from baseline to extended model: running over time, and per stretch of the travel."""
    layout = columns(2, shared=False)
    layout["xaxis"]["title"] = {"text": "fitted data [s]"}
    layout["xaxis2"]["title"] = {"text": axis_title("position", unit)}
    layout["yaxis"]["title"] = {"text": "log-likelihood gained [1]"}
    layout["annotations"] = [above("running sum over time", 1), above("per stretch of the travel", 2)]
    layout["showlegend"] = False
    bars = {"type": "bar", "x": numbers(accrual.position), "y": numbers(accrual.gained), "xaxis": "x2", "yaxis": "y2"}
    running = trace(accrual.seconds, accrual.running, "gained", AFTER, 1, width=2.2)
    return {"data": [running, {**bars, "marker": {"color": AFTER}, "name": "gained"}], "layout": layout}


def prediction_figure(seen: Prediction, unit: str, what: str = "unseen data", first: str = "baseline") -> Figure:
    """One-second free runs on `what`: position above, error below, in thousandths of the unit; `first` made them."""
    layout = bare(440)
    layout["xaxis"] = {"anchor": "y2", "title": {"text": f"{what} [s]"}}
    layout["yaxis"] = {"domain": [0.55, 1.0], "title": {"text": f"position [{unit}]"}}
    layout["yaxis2"] = {"domain": [0.0, 0.45], "title": {"text": f"error [m{unit}]"}, "anchor": "x"}
    cut = np.flatnonzero(np.diff(seen.run)) + 1
    t = np.insert(seen.t, cut, np.nan)
    step = np.diff(seen.t)
    gap = np.flatnonzero((step < 0.0) | (step > APART * np.median(step))) + 1
    whole, measured = np.insert(seen.t, gap, np.nan), np.insert(seen.position, gap, np.nan)
    data = [trace(whole, measured, "measured", MEASURED, 1, width=3.5)]
    for model, colour, error in ((first, BEFORE, seen.before), ("extended", AFTER, seen.after)):
        if error is not None:
            broken, place = np.insert(error, cut, np.nan), np.insert(seen.position, cut, np.nan)
            data.append({**trace(t, place - broken, model, colour, 1), "legendgroup": model})
            data.append({**trace(t, 1e3 * broken, model, colour, 1), "yaxis": "y2", "xaxis": "x"})
            data[-1] |= {"legendgroup": model, "showlegend": False}
    return {"data": data, "layout": layout}


def hidden_figure(detectable: dict[str, Hidden], remaining: float, force_unit: str) -> Figure:
    """Force from which each effect would have been seen, beside the force that does not repeat."""
    ordered = sorted(
        ((h.force_rms, name.replace("_", " ")) for name, h in detectable.items() if np.isfinite(h.force_rms)),
        reverse=True,
    )
    layout = bare(90 + 22 * len(ordered))
    layout["margin"]["l"] = 210
    layout["xaxis"] = {"type": "log", "title": {"text": f"force, rms [{show_unit(force_unit)}]"}, "dtick": 1}
    layout["showlegend"] = False
    data: list[Figure] = [
        {"type": "scatter", "mode": "markers", "x": [f for f, _ in ordered], "y": [n for _, n in ordered]}
        | {"marker": {"color": AFTER, "size": 10}, "name": "seen from"}
    ]
    line = {"type": "line", "x0": remaining, "x1": remaining, "y0": 0, "y1": 1, "yref": "paper"}
    layout["shapes"] = [{**line, "line": {"color": BEFORE, "dash": "dash", "width": 1.5}}]
    layout["annotations"] = [
        {"x": float(np.log10(max(remaining, 1e-12))), "y": 1, "yref": "paper", "yanchor": "bottom", "showarrow": False}
        | {"text": "force left unexplained"}
    ]
    return {"data": data, "layout": layout}


def recordings_figure(recordings: Sequence[Recording], length: str, force_unit: str) -> Figure:
    """Position and drive force of the recordings as they came."""
    layout = bare(380)
    layout["xaxis"] = {"anchor": "y2", "title": {"text": "time [s]"}}
    layout["yaxis"] = {"domain": [0.55, 1.0], "title": {"text": f"position [{length}]"}}
    layout["yaxis2"] = {"domain": [0.0, 0.45], "title": {"text": f"drive force [{show_unit(force_unit)}]"}}
    colours = (AFTER, BEFORE, MEASURED, "#009E73")
    data = []
    for index, recording in enumerate(recordings[: len(colours)]):
        every = slice(None, None, max(1, len(recording) // MOST_POINTS))
        name = recording.note or f"recording {index + 1}"
        t = recording.t[every] - recording.t[0]
        for row, values in ((1, recording.position), (2, recording.force)):
            line = trace(t, values[every], name, colours[index], 1, width=1.2)
            data.append({**line, "yaxis": "y2" if row == 2 else "y", "legendgroup": name, "showlegend": row == 1})
    return {"data": data, "layout": layout}


def pictures_figures(pictures: Pictures, location: Location | None) -> list[tuple[str, Figure]]:
    """Coordinate and figure of every map."""
    return [(one.coordinate, map_figure(one, pictures.force_unit, location)) for one in pictures.maps]


def bare(height: int) -> Figure:
    """A layout without colours of its own: the page's style sheet gives them."""
    return {
        "height": height,
        "autosize": True,
        "margin": {"l": WIDE, "r": 16, "t": 44, "b": 52},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": "system-ui, sans-serif", "size": 12},
        "legend": {"orientation": "h", "x": 1, "xanchor": "right", "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
        "annotations": [],
    }


def columns(count: int, *, shared: bool = True) -> Figure:
    """A layout of panels side by side; `shared`: all have the vertical scale of the first."""
    layout = bare(320)
    gap = 0.05 if shared else 0.1
    width = (1.0 - gap * (count - 1)) / count
    for number in range(1, count + 1):
        left = (number - 1) * (width + gap)
        suffix = "" if number == 1 else str(number)
        layout[axis("xaxis", number)] = {"domain": [left, left + width], "anchor": f"y{suffix}", "zeroline": False}
        layout[axis("yaxis", number)] = {"anchor": f"x{suffix}"}
        if shared and number > 1:
            layout[axis("yaxis", number)] |= {"matches": "y", "showticklabels": False}
    layout["margin"]["t"] = 64
    layout["legend"]["y"] = 1.12
    return layout


def axis(kind: str, number: int) -> str:
    """Plotly's name of an axis in the layout."""
    return kind if number == 1 else f"{kind}{number}"


def above(text: str, number: int) -> Figure:
    """The heading of a panel."""
    suffix = "" if number == 1 else str(number)
    place = {"x": 0, "xref": f"x{suffix} domain", "y": 1.01, "yref": f"y{suffix} domain"}
    return {**place, "text": text, "showarrow": False, "xanchor": "left", "yanchor": "bottom"}


def trace(x: Floats, y: Floats, name: str, colour: str, number: int, *, width: float = 1.6) -> Figure:
    """A line in panel `number`."""
    suffix = "" if number == 1 else str(number)
    drawn = {"type": "scatter", "mode": "lines", "x": numbers(x), "y": numbers(y), "name": name}
    return drawn | {"line": {"color": colour, "width": width}, "xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}


def numbers(values: Floats) -> list[float | None]:
    """Six digits are enough for a picture; what is not finite is a gap."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values.tolist()]


def axis_title(coordinate: str, unit: str) -> str:
    """Name of a coordinate with its unit."""
    return f"{coordinate.replace('_', ' ')} [{show_unit(unit)}]"


def show_unit(unit: str) -> str:
    """A unit as one prints it."""
    return unit.replace("*", "·").replace("^2", "²")
