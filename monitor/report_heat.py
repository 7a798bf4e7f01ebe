"""Residual force over two coordinates as a heat map: colour is force, grey is where nothing was measured. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from monitor.report_figures import Figure, axis, axis_title, bare, numbers, show_unit

if TYPE_CHECKING:
    from identify.mismatch.grids import Grid
    from identify.mismatch.result import Location

Floats = NDArray[np.float64]

# blue below zero, orange above: told apart by all kinds of colour vision, and by lightness from zero
SCALE = [[0.0, "#053061"], [0.25, "#4393c3"], [0.5, "#f7f7f7"], [0.75, "#e08214"], [1.0, "#7f3b08"]]
EMPTY = "rgba(128, 128, 128, 0.35)"
LOUDEST = 0.98  # quantile of the baseline's cells that has the full colour: a single cell must not dim all others
HEIGHT = 210  # px of one panel
GAP = 0.12  # of the height, between two panels
READING = (
    "Colour is the mean residual force of a cell: orange where the drive pushed more in the positive direction than "
    "the model needs, blue where it pushed less, grey where too little was measured to say. What belongs to a place "
    "is a column, what belongs to a speed or a moment a row. Dotted lines enclose the place that the diagnosis names."
)
MARK = {"color": "#000000", "width": 1.5, "dash": "dot"}


def grid_figure(grid: Grid, force_unit: str, location: Location | None) -> Figure:
    """One panel per model, both in the same colours; the place of the finding between dotted lines."""
    panels = [("baseline model", grid.before)]
    if grid.after is not None:
        panels.append(("with the effect in the model", grid.after))
    full = _full_colour(grid.before)
    layout = bare(len(panels) * HEIGHT + 110)
    layout["showlegend"] = False
    layout["plot_bgcolor"] = EMPTY
    layout["coloraxis"] = {"colorscale": SCALE, "cmin": -full, "cmax": full, "colorbar": _bar(force_unit)}
    layout["xaxis"] = {"anchor": axis("y", len(panels)), "title": {"text": axis_title("position", grid.length)}}
    layout["xaxis"] |= {"showgrid": False, "zeroline": False, "range": _ends(grid.position)}
    data: list[Figure] = []
    for number, (heading, force) in enumerate(panels, 1):
        data.append(_panel(grid, force, force_unit, number))
        layout[axis("yaxis", number)] = {
            "domain": _domain(number, len(panels)),
            "title": {"text": axis_title(grid.other, grid.unit)},
            "showgrid": False,
            "zeroline": False,
            "range": _ends(grid.edges),
        }
        place = {"x": 0, "xref": "paper", "y": 1.01, "yref": f"{axis('y', number)} domain"}
        layout["annotations"].append(
            {**place, "text": heading, "showarrow": False, "xanchor": "left", "yanchor": "bottom"}
        )
    layout["shapes"] = [shape for number in range(1, len(panels) + 1) for shape in _marks(grid, location, number)]
    return {"data": data, "layout": layout}


def grid_words(grid: Grid) -> str:
    """The heading above it."""
    if grid.other == "velocity":
        return "Over position and velocity (below zero: the way back)"
    return f"Over position and {grid.other}"


def _panel(grid: Grid, force: Floats, force_unit: str, number: int) -> Figure:
    """The cells of one model."""
    unit, length = show_unit(grid.unit), show_unit(grid.length)
    return {
        "type": "heatmap",
        "x": numbers(grid.position),
        "y": numbers(grid.edges),
        "z": [numbers(row) for row in force],
        "customdata": grid.count.tolist(),
        "coloraxis": "coloraxis",
        "hoverongaps": False,
        "yaxis": axis("y", number),
        "hovertemplate": f"position %{{x:.3g}} {length}<br>{grid.other} %{{y:.3g}} {unit}<br>"
        f"residual force %{{z:.3g}} {show_unit(force_unit)}, %{{customdata}} samples<extra></extra>",
    }


def _full_colour(force: Floats) -> float:
    """Force that has the full colour; 1 where there is none at all."""
    known = np.abs(force[np.isfinite(force)])
    full = float(np.quantile(known, LOUDEST)) if known.size else 0.0
    return float(f"{full:.2g}") or 1.0


def _bar(force_unit: str) -> Figure:
    """The scale of the colours."""
    return {"title": {"text": show_unit(force_unit), "side": "top"}, "thickness": 12, "outlinewidth": 0, "xpad": 4}


def _domain(number: int, panels: int) -> list[float]:
    """Lower and upper end of a panel, the first on top."""
    height = (1.0 - GAP * (panels - 1)) / panels
    top = 1.0 - (number - 1) * (height + GAP)
    return [max(top - height, 0.0), top]


def _marks(grid: Grid, location: Location | None, number: int) -> list[Figure]:
    """Dotted lines around the place that the diagnosis names, where it is drawn here."""
    if location is None or location.coordinate not in ("position", grid.other):
        return []
    upright = location.coordinate == "position"
    low, high = _ends(grid.position if upright else grid.edges)
    place, panel = axis("y", number), f"{axis('y', number)} domain"
    lines: list[Figure] = []
    for end in location.interval:
        if low < end < high and upright:
            lines.append({"xref": "x", "x0": end, "x1": end, "yref": panel, "y0": 0, "y1": 1})
        elif low < end < high:
            lines.append({"xref": "paper", "x0": 0, "x1": 1, "yref": place, "y0": end, "y1": end})
    return [{"type": "line", "line": MARK, **line} for line in lines]


def _ends(edges: Floats) -> list[float]:
    """First and last edge."""
    return [float(edges[0]), float(edges[-1])]
