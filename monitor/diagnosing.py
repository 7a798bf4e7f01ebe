"""What the laboratory does for an axis: diagnose its windows, or identify them again with another model. Pure."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from identify import diagnose
from monitor.estimate import Estimate
from monitor.identify_window import SOFTWARE, Job, finite, identify_window, recording_of
from monitor.picture_values import picture_values
from monitor.samples import Samples, Window
from monitor.store_records import DiagnosisRecord
from plant.axis import Axis
from plant.errors import TribowatchError
from plant.recording import Recording

WORDS = {
    "position": "m", "velocity": "m/s", "torque": "N*m", "time": "s",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class DiagnosisJob:
    """Windows to diagnose, oldest first; the last is held out. `axis` travels without its recordings."""

    axis: Axis
    windows: tuple[Window, ...]
    samples: tuple[Samples, ...]
    seed: int


def diagnose_windows(job: DiagnosisJob) -> DiagnosisRecord:
    """Diagnose all windows together, and where that names nothing the newest alone.

    What cannot be diagnosed is `insufficient_data` with its reason.
    """
    started = time.perf_counter()
    recordings = [recording_of(samples, job.axis) for samples in job.samples]
    windows = job.windows
    try:
        result = _answer(recordings, job)
        if result["verdict"] == "unexplained" and len(windows) > 1:  # what grows is not the same in every window
            alone = _answer(recordings[-1:], job)
            if alone["verdict"] == "explained":
                result, windows = alone, windows[-1:]
    except TribowatchError as error:
        result = {"verdict": "insufficient_data", "reason": str(error), "axis": job.axis.name, "effects": []}
    first, last = windows[0], windows[-1]
    return DiagnosisRecord(
        at_ns=last.end_ns,
        from_ns=first.start_ns,
        to_ns=last.end_ns,
        verdict=result["verdict"],
        result=result,
        windows=[[one.id.epoch, one.id.first_seq, one.id.samples] for one in windows],
        seed=job.seed,
        software=SOFTWARE,
        seconds=time.perf_counter() - started,
    )


def _answer(recordings: list[Recording], job: DiagnosisJob) -> dict[str, Any]:
    """The JSON of a diagnosis, with the pictures the page draws (they are not told over Zenoh)."""
    found = diagnose(recordings, job.axis, seed=job.seed)
    pictures = {} if found.pictures is None else {"pictures": picture_values(found.pictures)}
    return {**finite(found.to_dict()), **pictures}


def identify_again(jobs: tuple[Job, ...]) -> list[tuple[int, Estimate]]:
    """Identify stored windows once more, in order: row and answer of each."""
    return [(job.row, identify_window(job)) for job in jobs]


def finding_of(result: dict[str, Any]) -> str:
    """A diagnosis in words and numbers, as an alert shows it."""
    effects = result.get("effects", [])
    if result["verdict"] == "explained" and effects:
        named = "; ".join(_effect(one) for one in effects)
        others = [" + ".join(one) for one in result.get("alternatives", [])[1:3]]
        also = f"; the data cannot rule out {', '.join(others)}" if others else ""
        ratio = _improvement(result)
        return f"{named}{ratio}{also}"
    if result["verdict"] == "unexplained":
        place = result.get("location")
        where = "" if not place else f", along {place['coordinate']} {place['interval'][0]:.3g} to "
        where += "" if not place else f"{place['interval'][1]:.3g} {WORDS.get(place['coordinate'], '')}".rstrip()
        force = result.get("remaining_force")
        size = f"{force['value']:.2g} {force['unit']} " if force else "force "
        return f"{size}is left that no effect of the catalogue explains{where}"
    if result["verdict"] == "no_mismatch":
        return "more force is left unexplained than in the baseline, yet no structure in it that repeats"
    return f"more force is left unexplained than in the baseline; it cannot be diagnosed: {result.get('reason')}"


def _effect(effect: dict[str, Any]) -> str:
    """`rail defect at 0.62 m, 41 N ± 4`: where it is, then how big."""
    sizes: list[str] = []
    place = ""
    for name, one in effect["parameters"].items():
        half = (one["ci95"][1] - one["ci95"][0]) / 2 if one["ci95"] else None
        unit = "" if one["unit"] == "1" else f" {one['unit']}"
        if name in ("centre", "position", "rest_position"):
            place = f" at {one['value']:.3g}{unit}"
        elif not sizes:
            sizes.append(f"{one['value']:.3g}{unit}" + ("" if half is None else f" ± {half:.2g}"))
        elif name in ("width", "period", "time_constant", "delay"):
            sizes.append(f"{name.replace('_', ' ')} {one['value']:.2g}{unit}")
    return f"{effect['name'].replace('_', ' ')}{place}, {', '.join(sizes)}"


def _improvement(result: dict[str, Any]) -> str:
    """How much better data are predicted that the fit has not seen."""
    before, after = (result.get("fit", {}).get(model, {}).get("held_out") for model in ("baseline", "extended"))
    if not before or after is None or after >= before:
        return ""
    return f" (with it, a second ahead on unseen data is predicted {1 - (after / before) ** 0.5:.0%} better)"


def promotable(result: dict[str, Any]) -> list[str]:
    """Effects of a diagnosis that can become part of the axis' model."""
    return [one["name"] for one in result.get("effects", [])] if result["verdict"] == "explained" else []
