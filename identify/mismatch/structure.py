"""Force that repeats though nothing names it: along which coordinate, where on it, how sure.

Each coordinate proposes a shape, learnt on what was fitted and judged on what was not; a tone and a stretch of time
propose themselves. All compete by evidence, so that periodic motion, in which every coordinate is a function of every
other, does not decide by chance.
"""

from __future__ import annotations

from identify.mismatch.compare import Fit
from identify.mismatch.events import burst, slow_force, spell, stretch, tone
from identify.mismatch.nameless import Structure
from identify.mismatch.probes import outlooks
from identify.mismatch.sensor_errors import encoder_error, slip
from identify.mismatch.shapes import along_coordinates, judged
from identify.preprocess import Samples


def structures(fit: Fit, held_out: Samples, *, suspicious: bool = False) -> list[Structure]:
    """Everything that is sure, the most evident first; where one is `suspicious`, what few places tell of, too."""
    views = outlooks(fit, fit.on(held_out))
    here, there = views[0].here, views[0].there
    found = [
        structure
        for one in views
        for probe in along_coordinates(one.here, one.there)
        if (structure := judged(one, probe, suspicious=suspicious)) is not None
    ]
    others = (
        tone(here, there),
        encoder_error(here, there),
        stretch(here),
        slip(here),
        burst(fit) if suspicious else None,
        slow_force(here, there),
        spell(fit, held_out),
    )
    found += [s for s in others if s is not None]
    return sorted(found, key=lambda s: -s.evidence)
