"""Reports as files: one HTML page each, everything inlined, nothing fetched. Writes files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from plant.errors import InputError

if TYPE_CHECKING:
    from identify.mismatch.result import Diagnosis
    from identify.result import IdentificationResult
    from monitor.query_page import PageReader
    from plant.axis import Axis
    from plant.recording import Recording


def write_report(path: Path, found: Diagnosis, axis: Axis, recordings: Sequence[Recording]) -> None:
    """Write a diagnosis as a page at `path`.

    Args:
        path: of the file; its folder must exist.
        found: the diagnosis, with its pictures.
        axis: the machine.
        recordings: what was diagnosed.

    Raises:
        InputError: the file cannot be written.
    """
    from monitor.report_diagnosis import page

    _write(path, page(found, axis, recordings))


def write_identification(path: Path, found: IdentificationResult, axis: Axis, recording: Recording) -> None:
    """Write an identification as a page at `path`.

    Raises:
        InputError: the file cannot be written.
    """
    from monitor.report_identification import page

    _write(path, page(found, axis, recording))


def write_axis_report(path: Path, reader: PageReader, axis: str, since: str) -> None:
    """Write what the history holds of `axis` over its last span `since` (as in 90d) as a page at `path`.

    Raises:
        QueryError: unknown axis, or a span that is not understood.
        InputError: the file cannot be written.
    """
    from monitor.report_axis import page

    _write(path, page(reader, axis, since))


def check_folder(path: Path) -> None:
    """Complain before the work is done that its report could not be written.

    Raises:
        InputError: the folder does not exist.
    """
    if not path.absolute().parent.is_dir():
        raise InputError(f"{path}: the folder {path.absolute().parent} does not exist; create it first")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: the report cannot be written ({reason}); choose another --report FILE") from None
