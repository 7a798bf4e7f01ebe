"""Answer and score the cases of a foreign simulator: `make blind-foreign ARGS=FOLDER`.

The folder is what `author.md` asks an author for: `cases/case-NNNN/` and `labels.json`. Every case is diagnosed in a
process of its own that gets a copy of the case folder and nothing else; the labels have no permissions meanwhile,
and are opened only to score. Answers, `scores.json`, `report.md` and `report.json` go to `var/blind/NAME`. A
second start goes on where the first stopped; `--report` scores what is there.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from tests.blind.__main__ import answer, reported
from tests.blind.diagnosing import locked
from tests.blind.frozen import digest, engine
from tests.blind.scoring import Score, score

LABELS = "labels.json"
UNKNOWN = {"size": 0.0, "excitation": "", "noise": 0.0, "period": 0.0, "orientation": "", "shapes": ""}


def main() -> None:
    """Read the arguments and run."""
    parser = argparse.ArgumentParser(prog="python -m tests.blind.foreign", description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "folder", type=Path, help="holds cases/ and labels.json, as tests/blind/author.md asks for them"
    )
    parser.add_argument("--out", type=Path, default=Path("var/blind"))
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses at a time")
    parser.add_argument("--limit", type=float, default=900.0, help="CPU limit of a diagnosis [s]")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after so many minutes")
    parser.add_argument("--report", action="store_true", help="only score what is there and write the report")
    given = parser.parse_args()
    for wanted in (given.folder / "cases", given.folder / LABELS):
        if not wanted.exists():
            parser.error(f"{wanted} is not there: give a folder as tests/blind/author.md asks for it")
    out = given.out / given.folder.resolve().name
    (out / "answers").mkdir(parents=True, exist_ok=True)
    if not given.report:
        print(f"engine {engine()}, thresholds {digest()}", flush=True)
        until = time.monotonic() + 60 * given.minutes
        cases = sorted(path for path in (given.folder / "cases").iterdir() if path.is_dir())
        with locked(given.folder / LABELS), ThreadPoolExecutor(given.jobs) as pool:
            list(pool.map(lambda case: answer(case, out / "answers" / f"{case.name}.json", given.limit, until), cases))
    print(write_report(given.folder, out))


def write_report(folder: Path, out: Path) -> str:
    """Score the answers in `out` by the labels in `folder`, which are opened here; returns the report."""
    path = folder / LABELS
    path.chmod(0o600)
    labels = json.loads(path.read_text())
    scores, judged = scored(labels, out / "answers")
    notes = [f"{len(labels)} cases: sha256 {hashlib.sha256(path.read_bytes()).hexdigest()}"]
    return reported(out, f"cases of {folder.resolve().name}", scores, judged, notes)


def scored(labels: dict[str, Any], answers: Path) -> tuple[list[Score], set[str]]:
    """Scores of all cases that have an answer, and the engines that answered."""
    scores, judged = [], set()
    for name, label in sorted(labels.items()):
        path = answers / f"{name}.json"
        if path.exists():
            reply = json.loads(path.read_text())
            scores.append(score(name, as_sealed(label), reply))
            judged.add(f"engine {reply.get('engine', '?')}, thresholds {reply.get('thresholds', '?')}")
    return scores, judged


def as_sealed(label: dict[str, Any]) -> dict[str, Any]:
    """A label of `author.md` as `scoring` reads it."""
    kind = {"healthy": "smooth"}.get(label["kind"], label["kind"])
    outside = {"interval": None, **label["outside"]} if kind == "outside" else None
    return {
        "kind": kind,
        "effects": label["effects"] if kind in ("single", "pair") else {},
        "outside": outside,
        "shapes": label.get("own_curves", []),
        "severity_ratio": label.get("severity"),
        "spec": UNKNOWN,
    }


if __name__ == "__main__":
    main()
