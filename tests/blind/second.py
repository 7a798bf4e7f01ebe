"""Which cases a study of the second simulator draws, and drawing one; every case has generators of its own.

Its author's own 64 cases, generators [7, index] and 1000 on where one was refused, trained; studies below `JUDGE_SEED`
train too, as do those that judged and were read: to 1 260 000.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.second.cases import PAIRS, Case, CaseSpec, UndrawableError, draw_case
from tests.second.effects import EFFECTS
from tests.second.outside import OUTSIDE

ATTEMPTS = 20  # draws until one shows what is hidden
KINDS = {"single": 0.53, "pair": 0.16, "outside": 0.16, "smooth": 0.08, "rough": 0.07}


def draw_spec(seed: int, index: int) -> CaseSpec:
    """Specification of case `index` of the study `seed`."""
    rng = np.random.default_rng([906, seed, index])
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    names: tuple[str, ...] = ()
    if kind == "single":
        names = (str(rng.choice(list(EFFECTS))),)
    if kind == "pair":
        names = PAIRS[rng.integers(len(PAIRS))]
    if kind == "outside":
        names = (str(rng.choice(list(OUTSIDE))),)
    return CaseSpec(kind, names, int(rng.integers(2)) if kind == "single" else 0)


def draw(seed: int, index: int, name: str) -> tuple[dict, Case | None]:
    """Sealed label and case `index`, called `name`; None, with the reasons in the label, where no draw shows it."""
    spec = draw_spec(seed, index)
    refused: list[str] = []
    for attempt in range(ATTEMPTS):
        try:
            case = draw_case(np.random.default_rng([907, seed, index, attempt]), spec)
        except UndrawableError as error:
            refused.append(str(error))
            continue
        return {"kind": spec.kind, "refused": refused, "true_criterion": None, **case.labels}, replace(case, name=name)
    return {"kind": spec.kind, "refused": refused, "expected": None}, None
