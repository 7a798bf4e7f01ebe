"""THE MACHINE, or its stand-in: what moves, what resists, what it sends."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant.axis_file import read_axis, write_axis
    from plant.recording_files import read_recording, write_recording
    from plant.simulation import Trajectory, simulate, simulate_population

_HOME = {
    "Trajectory": "simulation",
    "read_axis": "axis_file",
    "write_axis": "axis_file",
    "read_recording": "recording_files",
    "simulate": "simulation",  # not simulate.py: a sub-module of that name would hide the function
    "simulate_population": "simulation",
    "write_recording": "recording_files",
}
__all__ = [
    "Trajectory",
    "read_axis",
    "read_recording",
    "simulate",
    "simulate_population",
    "write_axis",
    "write_recording",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first asked for: `tribowatch --help` needs neither numpy nor numba."""
    if name not in _HOME:
        raise AttributeError(f"module 'plant' has no attribute {name!r}")
    return getattr(importlib.import_module(f"plant.{_HOME[name]}"), name)
