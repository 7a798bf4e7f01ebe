"""Run the blind study: `python -m tests.blind --cases 600 --seed 900000`, or `make blind ARGS="--cases 40"`.

Cases are drawn in batches: the batch's labels are written to `sealed/` and hashed, then its case folders, then each is
diagnosed in a process of its own. A second start goes on where the first stopped. Scores are made at the end, from the
files; `report.txt` and `scores.json` lie beside them. Expect 600 cases to take 2-4 hours of one core.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from tests.blind.diagnosing import ROOT, ask, locked
from tests.blind.plan import JUDGE_SEED
from tests.blind.scoring import Score, score
from tests.blind.sealing import Study, seal
from tests.blind.tables import report

BATCH = 20


def main() -> None:
    """Read the arguments and run."""
    parser = argparse.ArgumentParser(prog="python -m tests.blind", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=600)
    parser.add_argument("--seed", type=int, default=JUDGE_SEED, help="below 900000 while developing")
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses at a time")
    parser.add_argument("--out", type=Path, default=Path("var/blind"))
    parser.add_argument("--duration", type=float, default=30.0, help="of each recording [s]; half at 1 kHz")
    parser.add_argument("--limit", type=float, default=300.0, help="time limit of a diagnosis [s]")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after so many minutes")
    parser.add_argument("--batch", type=int, default=BATCH, help="cases sealed together")
    given = parser.parse_args()
    study = Study(given.seed, given.cases, given.out / f"seed-{given.seed}", given.duration)
    study.folder.mkdir(parents=True, exist_ok=True)
    print(f"engine {engine()}", flush=True)
    run(study, given.jobs, given.limit, time.monotonic() + 60 * given.minutes, given.batch)
    print(write_report(study, given.batch))


def engine() -> str:
    """Hash of the code that is judged: all of plant/ and identify/."""
    found = hashlib.sha256()
    for path in sorted(path for room in ("plant", "identify") for path in (ROOT / room).rglob("*.py")):
        found.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return found.hexdigest()[:16]


def batches(study: Study, size: int) -> Iterator[range]:
    """Ranges of case numbers that are sealed together."""
    return (range(start, min(start + size, study.cases)) for start in range(0, study.cases, size))


def run(study: Study, jobs: int, limit: float, until: float, size: int) -> None:
    """Seal and diagnose batch by batch until all is done or the time `until` (monotonic, s) has come."""
    (study.folder / "answers").mkdir(exist_ok=True)
    for batch in batches(study, size):
        if time.monotonic() > until:
            return
        print(f"labels {batch.start}-{batch.stop - 1} sealed: sha256 {seal(study, batch)}", flush=True)
        todo = [index for index in batch if study.case(index).exists() and not study.answer(index).exists()]
        with locked(study.folder / "sealed"), ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda index: _answer(study, index, limit, until), todo))


def _answer(study: Study, index: int, limit: float, until: float) -> None:
    if time.monotonic() > until:
        return
    reply = {**ask(study.case(index), limit), "engine": engine()}
    part = study.answer(index).with_suffix(".part")
    part.write_text(json.dumps(reply, indent=1))
    part.rename(study.answer(index))
    verdict = reply["answer"]["verdict"] if reply["answer"] else f"no answer (exit {reply['exit']})"
    print(f"{study.name(index)} {reply['seconds']:6.1f} s  {verdict}", flush=True)


def scored(study: Study, size: int) -> tuple[list[Score], int]:
    """Scores of all answered cases, and how many cases no seed could draw."""
    scores, undrawable = [], 0
    for batch in batches(study, size):
        if not study.labels(batch).exists():
            continue
        labels = json.loads(study.labels(batch).read_text())
        for index in batch:
            label = labels[study.name(index)]
            undrawable += label["expected"] is None
            if study.answer(index).exists():
                scores.append(score(study.name(index), label, json.loads(study.answer(index).read_text())))
    return scores, undrawable


def write_report(study: Study, size: int) -> str:
    """Score all answers; writes scores.json and report.txt and returns the report."""
    scores, undrawable = scored(study, size)
    text = report(scores, undrawable)
    (study.folder / "scores.json").write_text(json.dumps([asdict(s) for s in scores], indent=1))
    (study.folder / "report.txt").write_text(text)
    return text


if __name__ == "__main__":
    main()
