"""Evidence of an alert as one zip: raw window, answer, fit and residuals, the state of the watch; enough to replay it.

Pure: bytes in, bytes out. `README.txt` in the zip says what is in it, and what is not.
"""

from __future__ import annotations

import csv
import io
import json
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np

from monitor.errors import QueryError
from monitor.evidence_fit import FitSamples
from monitor.samples import Samples

SCHEMA_VERSION = 1
MANIFEST, WINDOW, README = "manifest.json", "window.csv", "README.txt"
LARGEST = 200_000_000  # bytes of one unpacked file
STAMP = (1980, 1, 1, 0, 0, 0)  # of every file in the zip: the same evidence gives the same bytes
CHANNELS = ("drive", "position", "velocity", "temperature", "load")

WORDS = """\
Evidence of an alert of tribowatch: {id}
{text}

manifest.json  the alert, its change of state, the constants of the axis, the answer to the window, and the state of the
               watch before it. SI units; times are nanoseconds of Unix time, UTC (..._ns).
{window}
It holds nothing else: no other axis, no other time, no addresses, no passwords. Who acknowledged or shelved the alert
may be named in the manifest (author). Replay it with: tribowatch alerts replay-evidence FILE
"""
WITH_WINDOW = """\
window.csv     the raw samples as the machine sent them (t_ns; drive in {unit}; position; velocity, temperature, load
               where sent), and beside them the fit: free runs of the identified model over one second each, started
               from the measured motion (fit_position), and what they miss (residual = position - fit_position).
"""


@dataclass(frozen=True, slots=True)
class Bundle:
    """What a zip of evidence holds; `samples` is None for an alert that rests on no window."""

    manifest: dict[str, Any]
    samples: Samples | None


def pack(manifest: dict[str, Any], samples: Samples | None, fit: FitSamples | None = None) -> bytes:
    """The zip. `manifest` is JSON with at least `alert`; `fit` belongs to the samples."""
    body = io.BytesIO()
    alert = manifest["alert"]
    unit = "" if samples is None else "N" if samples.is_force else "N*m"
    window = "" if samples is None else WITH_WINDOW.format(unit=unit)
    files = {
        README: WORDS.format(id=alert["id"], text=alert["text"], window=window),
        MANIFEST: json.dumps({"schema_version": SCHEMA_VERSION, **manifest}, indent=1, allow_nan=False),
    }
    if samples is not None:
        files[WINDOW] = _csv(samples, fit)
    with zipfile.ZipFile(body, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name, STAMP), text, zipfile.ZIP_DEFLATED)
    return body.getvalue()


def _csv(samples: Samples, fit: FitSamples | None) -> str:
    columns: dict[str, Any] = {"t_ns": samples.t_ns.tolist()}
    for name in CHANNELS:
        if (values := getattr(samples, name)) is not None:
            columns[name] = values.tolist()
    if fit is not None:
        columns |= {"fit_position": fit.position.tolist(), "residual": (samples.position - fit.position).tolist()}
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    # repr of a float is read back bit by bit; NaN is left empty
    writer.writerows(
        ["" if value != value else repr(value) for value in row] for row in zip(*columns.values(), strict=True)
    )
    return out.getvalue()


def unpack(blob: bytes) -> Bundle:
    """Read what `pack` wrote.

    Raises:
        QueryError: no zip of ours, damaged, or of a newer program.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(blob)) as archive:
            if any(one.file_size > LARGEST for one in archive.infolist()):
                raise QueryError(f"this evidence holds a file of more than {LARGEST} bytes; it is not ours")
            manifest = json.loads(archive.read(MANIFEST))
            text = archive.read(WINDOW).decode() if WINDOW in archive.namelist() else None
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError) as error:
        raise QueryError(f"this is no evidence of tribowatch: {error}") from None
    if not isinstance(manifest, dict) or manifest.get("schema_version") != SCHEMA_VERSION:
        raise QueryError("this evidence is of another version of tribowatch; replay it with that one")
    try:
        return Bundle(manifest, None if text is None else _samples(text, manifest["window"]))
    except (KeyError, ValueError, TypeError) as error:
        raise QueryError(f"this evidence is damaged ({type(error).__name__}: {error})") from None


def contents(blob: bytes) -> dict[str, Any]:
    """What a zip of evidence holds, for people: its `readme`, its `files` with their sizes. [bytes]"""
    with zipfile.ZipFile(io.BytesIO(blob)) as archive:
        files = {one.filename: one.file_size for one in archive.infolist()}
        return {"readme": archive.read(README).decode(), "files": files}


def _samples(text: str, window: dict[str, Any]) -> Samples:
    rows = list(csv.DictReader(io.StringIO(text)))
    t_ns = np.array([int(row["t_ns"]) for row in rows], dtype=np.int64)
    channels = {
        name: np.array([float(row[name] or "nan") for row in rows]) for name in CHANNELS if rows and name in rows[0]
    }
    return Samples(window["epoch"], window["first_seq"], t_ns, is_force=window["is_force"], **channels)
