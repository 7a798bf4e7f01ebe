"""The pictures of a diagnosis as plain values for the history, and back as the figures of the report. Pure.

What the report draws from memory the page draws from the history: both by `report_figures`.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from monitor import report_figures
from monitor.report_heat import READING, grid_figure, grid_words

if TYPE_CHECKING:
    from identify.mismatch.grids import Grid
    from identify.mismatch.maps import Halves
    from identify.mismatch.pictures import Pictures

DIGITS = 4  # significant, of what is only looked at
COLOURS = 3  # significant digits of what is shown as a colour
MOST = 800  # points of the predictions that are kept


def picture_values(pictures: Pictures) -> dict[str, Any]:
    """What a page draws of `pictures`, for `result["pictures"]` of a stored diagnosis."""
    seen = pictures.prediction
    every = slice(None, None, max(1, -(-len(seen.t) // MOST)))
    accrual = pictures.accrual
    return {
        "force_unit": pictures.force_unit,
        "position_unit": pictures.position_unit,
        "maps": [
            {
                "coordinate": one.coordinate,
                "unit": one.unit,
                "middle": _plain(one.middle),
                "before": _halves(one.before),
                "after": None if one.after is None else _halves(one.after),
            }
            for one in pictures.maps
        ],
        "grids": [_grid(one) for one in pictures.grids],
        "accrual": None if accrual is None else {
            name: _plain(getattr(accrual, name)) for name in ("seconds", "running", "position", "gained")
        },
        "prediction": {
            "t": _plain(seen.t[every], 7),
            "run": seen.run[every].tolist(),
            "position": _plain(seen.position[every], 7),
            "before": _plain(seen.before[every]),
            "after": None if seen.after is None else _plain(seen.after[every]),
        },
    }  # fmt: skip


def figures_of(values: dict[str, Any] | None, location: dict[str, Any] | None) -> list[dict[str, Any]]:
    """Title and figure of every picture in `values`; none where none were kept.

    Args:
        values: of `picture_values`, through JSON.
        location: of the diagnosis' JSON.
    """
    if not values:
        return []
    from identify.mismatch.maps import Map
    from identify.mismatch.pictures import Accrual, Prediction
    from identify.mismatch.result import Location

    force, length = values["force_unit"], values["position_unit"]
    where = None
    if location:
        fields = {field.name for field in dataclasses.fields(Location)}
        known = {name: value for name, value in location.items() if name in fields}
        where = Location(**{**known, "interval": tuple(location["interval"])})
    grids = [_grid_of(one) for one in values.get("grids", [])]  # older diagnoses have none
    found = [(grid_words(one), grid_figure(one, force, where)) for one in grids]
    found += [
        (
            f"Along {one['coordinate'].replace('_', ' ')}",
            report_figures.map_figure(
                Map(
                    one["coordinate"],
                    one["unit"],
                    _array(one["middle"]),
                    _halves_of(one["before"]),
                    None if one["after"] is None else _halves_of(one["after"]),
                ),
                force,
                where,
            ),
        )
        for one in values["maps"]
    ]
    if (accrual := values["accrual"]) is not None:
        columns = Accrual(**{name: _array(column) for name, column in accrual.items()})
        found.append(("How the evidence builds up", report_figures.accrual_figure(columns, length)))
    seen = values["prediction"]
    prediction = Prediction(
        _array(seen["t"]),
        np.array(seen["run"]),
        _array(seen["position"]),
        _array(seen["before"]),
        None if seen["after"] is None else _array(seen["after"]),
    )
    found.append(("One-second predictions of unseen data", report_figures.prediction_figure(prediction, length)))
    entries: list[dict[str, Any]] = [{"title": title, "figure": figure} for title, figure in found]
    if grids:
        entries[0]["note"] = READING
    return entries


def _halves(one: Halves) -> dict[str, Any]:
    return {name: _plain(getattr(one, name)) for name in ("even", "odd", "rms")}


def _halves_of(values: dict[str, Any]) -> Halves:
    from identify.mismatch.maps import Halves

    return Halves(*(_array(values[name]) for name in ("even", "odd", "rms")))


def _grid(one: Grid) -> dict[str, Any]:
    """A grid without its edges' repetition: they are equally far apart."""
    return {
        "other": one.other,
        "unit": one.unit,
        "length": one.length,
        "position": [float(one.position[0]), float(one.position[-1])],
        "edges": [float(one.edges[0]), float(one.edges[-1])],
        "count": one.count.tolist(),
        "before": [_plain(row, COLOURS) for row in one.before],
        "after": None if one.after is None else [_plain(row, COLOURS) for row in one.after],
    }


def _grid_of(values: dict[str, Any]) -> Grid:
    from identify.mismatch.grids import Grid

    count = np.array(values["count"], dtype=np.int64)
    return Grid(
        values["other"],
        values["unit"],
        values["length"],
        np.linspace(values["position"][0], values["position"][1], count.shape[1] + 1),
        np.linspace(values["edges"][0], values["edges"][1], count.shape[0] + 1),
        count,
        np.array([_array(row) for row in values["before"]]),
        None if values["after"] is None else np.array([_array(row) for row in values["after"]]),
    )


def _plain(values: np.ndarray, digits: int = DIGITS) -> list[float | None]:
    """Numbers for JSON: rounded, null where there is none."""
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in np.asarray(values).tolist()]


def _array(values: list[float | None]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
