"""Which cases a study draws: kinds, excitations, noise, sizes at random from one seed; every case has its own."""

from __future__ import annotations

import numpy as np

from tests.reference.cases import CaseSpec
from tests.reference.draws import CLOSED_KINDS, OPEN_KINDS
from tests.reference.foreign import OUTSIDE
from tests.reference.parameters import EFFECTS

JUDGE_SEED = 1_000_000  # seeds from here on judge; those below train, and those that judged and were read: to 1 580 000
ATTEMPTS = 20  # seeds a case may use up before its machine can be drawn
KINDS = {"single": 0.50, "pair": 0.15, "outside": 0.15, "smooth": 0.08, "rough": 0.07, "still": 0.05}
NOISES = (1e-5, 1e-4, 1e-3)  # [m] on 0.4 m of travel
SIZES = (0.25, 1.4)
ORIENTATIONS = {"vertical": 0.7, "horizontal": 0.15, "rotary": 0.15}
FAST = 0.1  # share of the cases recorded at 1 kHz
BEFORE = 0.1  # share of the single effects recorded as commissioning and today
ROUGH = 0.03  # slow wandering of the dry level


def draw_spec(seed: int, index: int, duration: float = 30.0) -> tuple[str, CaseSpec]:
    """Kind and specification of case `index` of the study `seed`; its seeds are seed + ATTEMPTS * index and on."""
    rng = np.random.default_rng([905, seed, index])
    kind = _pick(rng, KINDS)
    names = list(EFFECTS)
    effects: tuple[str, ...] = ()
    if kind in ("single", "still"):
        effects = (str(rng.choice(names)),)
    if kind == "pair":
        effects = tuple(str(name) for name in rng.choice(names, 2, replace=False))
    fast = rng.random() < FAST
    before = kind == "single" and rng.random() < BEFORE
    spec = CaseSpec(
        seed=seed + ATTEMPTS * index,
        effects=effects,
        outside=str(rng.choice(list(OUTSIDE))) if kind == "outside" else None,
        excitation="still" if kind == "still" else str(rng.choice([*OPEN_KINDS, *CLOSED_KINDS])),
        size=float(rng.uniform(*SIZES)),
        noise=float(rng.choice(NOISES)),
        period=0.001 if fast else 0.01,
        duration=0.5 * duration if fast else duration,
        recordings=1 if before else 2,
        before=before,
        dirt=float(rng.choice([0.0025, 0.005, 0.01])),
        rough=ROUGH if kind == "rough" else 0.0,
        shapes=str(rng.choice(["catalogue", "foreign"])),
        artefacts=str(rng.choice(["typical", "typical", "harsh"])),
        orientation=_pick(rng, ORIENTATIONS),
    )
    return kind, spec


def _pick(rng: np.random.Generator, shares: dict[str, float]) -> str:
    return str(rng.choice(list(shares), p=list(shares.values())))
