"""MATLAB files up to version 7: vectors are columns, those in structs are named `struct.field`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.errors import RecordingError
from plant.row_selection import Choose, Floats, Select, check_selected, keep_rows


def read_mat(path: Path, choose: Choose, select: Select) -> dict[str, Floats]:
    """Read the columns that `choose` asks for, from the rows that match `select`; errors as `read_table`."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise RecordingError(f"{path}: MATLAB 7.3 file; save it with -v7, or as csv") from None
    except (MatReadError, ValueError, TypeError, KeyError, IndexError) as error:
        raise RecordingError(f"{path}: cannot be read as .mat: {error}") from None
    vectors = dict(_vectors(content))
    check_selected(path, list(vectors), select)
    wanted = choose(list(vectors))
    used = {name: vectors[name] for name in [*wanted.values(), *select]}
    if len({len(vector) for vector in used.values()}) > 1:
        lengths = ", ".join(f"{name} {len(vector)}" for name, vector in used.items())
        raise RecordingError(f"{path}: columns differ in length: {lengths} samples")
    keep = keep_rows(path, {name: [str(cell).strip() for cell in used[name]] for name in select}, select)
    try:
        return {ours: np.asarray(used[name], dtype=np.float64)[keep] for ours, name in wanted.items()}
    except (ValueError, TypeError) as error:
        raise RecordingError(f"{path}: a column is not made of numbers: {error}") from None


def _vectors(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield vectors by name, those in structs as `struct.field`."""
    for name, value in content.items():
        if name.startswith("__"):
            continue
        if isinstance(value, Mapping):
            yield from _vectors(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) and value.size == max(value.shape, default=0) and value.size > 1:
            yield f"{prefix}{name}", value.ravel()


def write_mat(path: Path, columns: Mapping[str, Floats]) -> None:
    """Write columns as MATLAB vectors of their names."""
    from scipy.io import savemat

    savemat(path, dict(columns), oned_as="column", appendmat=False)
