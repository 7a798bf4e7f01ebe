"""Draw a batch of cases; write and hash the sealed labels first, only then what a user would have."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path

from tests.blind import second
from tests.blind.plan import ATTEMPTS, draw_spec
from tests.blind.truth import beside, criterion
from tests.reference.cases import Case, UndrawableError, draw_case, write_case
from tests.second.cases import Case as SecondCase
from tests.second.cases import write_case as write_second_case

SIMULATORS = ("reference", "second")


@dataclass(frozen=True)
class Study:
    """A study: its seed, how many cases, seconds per recording, the folder all of it lives in, whose cases they are.

    `sealed/` holds the labels, `cases/` axis.toml and CSV, `answers/` what the diagnosis said. The second simulator
    draws the seconds of its recordings itself.
    """

    seed: int
    cases: int
    folder: Path
    duration: float = 30.0
    simulator: str = SIMULATORS[0]

    def name(self, index: int) -> str:
        """Name of a case; it says nothing, not even its seed."""
        return f"case-{index:04d}"

    def labels(self, batch: range) -> Path:
        """The sealed file of a batch."""
        return self.folder / "sealed" / f"labels-{batch.start:04d}-{batch.stop - 1:04d}.json"

    def case(self, index: int) -> Path:
        """Folder of a case."""
        return self.folder / "cases" / self.name(index)

    def answer(self, index: int) -> Path:
        """File of the answer to a case."""
        return self.folder / "answers" / f"{self.name(index)}.json"

    def rival(self, index: int) -> Path:
        """File of what the rival methods said."""
        return self.folder / "rivals" / f"{self.name(index)}.json"


def draw(study: Study, index: int) -> tuple[dict, Case | SecondCase | None]:
    """Sealed label and case `index`; None, with the reasons in the label, where no seed gives a machine that moves."""
    if study.simulator == "second":
        return second.draw(study.seed, index, study.name(index))
    kind, refused, case = drawable(study.seed, index, study.duration)
    if case is None:
        return {"kind": kind, "refused": refused, "expected": None}, None
    case = replace(case, axis={**case.axis, "name": study.name(index)})  # its own name tells the seed
    yardstick = criterion(case) if kind != "still" else None
    shows = {"beside": beside(case)} if kind == "pair" else {}
    return {"kind": kind, "refused": refused, "true_criterion": yardstick, **shows, **case.labels}, case


def drawable(seed: int, index: int, duration: float = 30.0) -> tuple[str, list[str], Case | None]:
    """Kind of case `index` of the study `seed`, why seeds of its machine were refused, and the first that moves."""
    kind, spec = draw_spec(seed, index, duration)
    refused = []
    for attempt in range(ATTEMPTS):
        try:
            return kind, refused, draw_case(replace(spec, seed=spec.seed + attempt))
        except UndrawableError as error:
            refused.append(str(error))
    return kind, refused, None


def seal(study: Study, batch: range) -> str:
    """Draw a batch, write its labels, then its folders; returns the SHA-256 of the labels' file.

    A batch that is complete is left alone. One that was interrupted is drawn again and must give the same labels.

    Raises:
        RuntimeError: the file of labels exists and says something else: another version of the simulator wrote it.
    """
    path, done = study.labels(batch), study.folder / "cases" / f"complete-{batch.start:04d}-{batch.stop - 1:04d}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.parent.chmod(0o700)  # a study that was killed left it locked
    if path.exists() and done.exists():
        return hashlib.sha256(path.read_bytes()).hexdigest()
    drawn = {index: draw(study, index) for index in batch}
    labels = {study.name(index): label for index, (label, _) in drawn.items()}
    text = json.dumps(labels, indent=1, sort_keys=True) + "\n"
    if path.exists() and path.read_text() != text:
        raise RuntimeError(f"{path} was drawn by another simulator: use another --out")
    path.write_text(text)
    write = write_second_case if study.simulator == "second" else write_case
    for index, (_, case) in drawn.items():
        if case is not None:
            write(case, study.case(index))
    done.touch()
    return hashlib.sha256(text.encode()).hexdigest()
