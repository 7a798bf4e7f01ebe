"""A case of the independent simulator, read as a user would read it from its folder."""

from __future__ import annotations

import tempfile
from pathlib import Path

from plant.axis import Axis
from plant.axis_file import read_axis
from plant.recording import Recording
from plant.recording_files import read_recording_entry
from tests.reference.cases import Case, write_case


def recorded(case: Case) -> tuple[Axis, list[Recording]]:
    """Axis and recordings of a case."""
    with tempfile.TemporaryDirectory() as folder:
        axis = read_axis(write_case(case, Path(folder)))
        return axis, [read_recording_entry(entry, axis) for entry in axis.recordings]
