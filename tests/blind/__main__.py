"""Run the blind study: `make blind`, `make blind-second` (another simulator), or `make blind ARGS="--cases 40"`.

Cases are drawn in batches: the batch's labels are written to `sealed/` and hashed, then its case folders, then each is
diagnosed in a process of its own (with `--rivals`, put through the rival methods too). A second start goes on where the
first stopped. Scores are made from the files, after each batch and at the end: `report.md`, `report.json` and
`scores.json` in the study's folder. Expect 600 cases to take 2-4 hours of one core.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from tests.blind.diagnosing import ask, ask_rivals, locked
from tests.blind.frozen import digest, engine
from tests.blind.plan import JUDGE_SEED
from tests.blind.scoring import Score, score
from tests.blind.sealing import SIMULATORS, Study, seal
from tests.blind.tables import sections

BATCH = 20
RIVAL_LIMIT = 60.0  # s of CPU for all rival methods on one case


def main() -> None:
    """Read the arguments and run."""
    parser = argparse.ArgumentParser(prog="python -m tests.blind", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=600)
    parser.add_argument("--seed", type=int, default=JUDGE_SEED, help=f"below {JUDGE_SEED} while developing")
    parser.add_argument("--simulator", choices=SIMULATORS, default=SIMULATORS[0], help="whose cases")
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses at a time")
    parser.add_argument("--out", type=Path, default=Path("var/blind"))
    parser.add_argument(
        "--duration", type=float, default=30.0, help="of each recording [s]; half at 1 kHz; not --simulator second"
    )
    parser.add_argument("--limit", type=float, default=120.0, help="CPU limit of a diagnosis [s]")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after so many minutes")
    parser.add_argument("--batch", type=int, default=BATCH, help="cases sealed together")
    parser.add_argument("--rivals", action="store_true", help="the rival methods on the same cases too")
    parser.add_argument("--report", action="store_true", help="only score what is there and write the report")
    given = parser.parse_args()
    folder = f"seed-{given.seed}" if given.simulator == SIMULATORS[0] else f"{given.simulator}-seed-{given.seed}"
    study = Study(given.seed, given.cases, given.out / folder, given.duration, given.simulator)
    study.folder.mkdir(parents=True, exist_ok=True)
    print(f"engine {engine()}, thresholds {digest()}", flush=True)
    if not given.report:
        until = time.monotonic() + 60 * given.minutes
        run(study, given.jobs, given.limit, until, given.batch, given.rivals)
    print(write_report(study, given.batch))


def batches(study: Study, size: int) -> Iterator[range]:
    """Ranges of case numbers that are sealed together."""
    return (range(start, min(start + size, study.cases)) for start in range(0, study.cases, size))


def run(study: Study, jobs: int, limit: float, until: float, size: int, rivals: bool = False) -> None:
    """Seal and diagnose batch by batch until all is done or the time `until` (monotonic, s) has come."""
    (study.folder / "answers").mkdir(exist_ok=True)
    (study.folder / "rivals").mkdir(exist_ok=True)
    for batch in batches(study, size):
        if time.monotonic() > until:
            return
        print(f"labels {batch.start}-{batch.stop - 1} sealed: sha256 {seal(study, batch)}", flush=True)
        cases = [index for index in batch if study.case(index).exists()]
        with locked(study.folder / "sealed"), ThreadPoolExecutor(jobs) as pool:
            list(pool.map(lambda index: answer(study.case(index), study.answer(index), limit, until), cases))
            if rivals:
                list(pool.map(lambda index: _rival(study, index, until), cases))
        write_report(study, size)


def answer(case: Path, path: Path, limit: float, until: float) -> None:
    """Diagnose a case into the file `path`, unless that is there or the time `until` (monotonic, s) has come."""
    if path.exists() or time.monotonic() > until:
        return
    reply = {**ask(case, limit), "engine": engine(), "thresholds": digest()}
    _write(path, reply)
    verdict = reply["answer"]["verdict"] if reply["answer"] else f"no answer (exit {reply['exit']})"
    print(f"{case.name} {reply['seconds']:6.1f} s  {verdict}", flush=True)


def _rival(study: Study, index: int, until: float) -> None:
    if not study.rival(index).exists() and time.monotonic() <= until:
        _write(study.rival(index), ask_rivals(study.case(index), RIVAL_LIMIT))


def _write(path: Path, reply: dict) -> None:
    """A whole file or none."""
    part = path.with_suffix(".part")
    part.write_text(json.dumps(reply, indent=1))
    part.rename(path)


def scored(study: Study, size: int) -> tuple[list[Score], list[str], set[str]]:
    """Scores of all answered cases, what there is to say about the labels, and the engines that answered."""
    scores, notes, judged = [], [], set()
    for batch in batches(study, size):
        if not study.labels(batch).exists():
            continue
        labels = json.loads(study.labels(batch).read_text())
        notes.append(f"labels {batch.start}-{batch.stop - 1}: sha256 {seal(study, batch)}")
        undrawable = sum(labels[study.name(index)]["expected"] is None for index in batch)
        notes[-1] += f", {undrawable} could not be drawn" if undrawable else ""
        for index in batch:
            label = labels[study.name(index)]
            if study.answer(index).exists():
                reply = json.loads(study.answer(index).read_text())
                rivals = json.loads(study.rival(index).read_text()) if study.rival(index).exists() else None
                scores.append(score(study.name(index), label, reply, rivals))
                judged.add(f"engine {reply.get('engine', '?')}, thresholds {reply.get('thresholds', '?')}")
    return scores, notes, judged


def write_report(study: Study, size: int) -> str:
    """Score all answers; writes scores.json, report.md and report.json and returns the report."""
    scores, notes, judged = scored(study, size)
    whose = "" if study.simulator == SIMULATORS[0] else f"{study.simulator} simulator, "
    return reported(study.folder, f"{whose}seed {study.seed}", scores, judged, notes)


def reported(folder: Path, what: str, scores: list[Score], judged: set[str], notes: list[str]) -> str:
    """Write scores.json, report.md and report.json to `folder`; returns the report."""
    found = sections(scores)
    head = [f"# Blind study, {what}: {len(scores)} cases scored", "",
            f"Judged: {'; '.join(sorted(judged)) or 'nothing yet'}. Rates with 95 % Wilson intervals.", ""]  # fmt: skip
    text = "\n".join([*head, *(section.markdown() for section in found), "## Sealed labels", ""])
    text += "\n".join(f"- {note}" for note in notes) + "\n"
    report = {"study": what, "cases": len(scores), "judged": sorted(judged), "labels": notes,
              "sections": [section.to_dict() for section in found]}  # fmt: skip
    (folder / "scores.json").write_text(json.dumps([asdict(s) for s in scores], indent=1))
    (folder / "report.json").write_text(json.dumps(report, indent=1))
    (folder / "report.md").write_text(text)
    return text


if __name__ == "__main__":
    main()
