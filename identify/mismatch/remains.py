"""What is left without a name, beside the chosen effects or where none is chosen: along which coordinate, and where."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from identify.mismatch import words
from identify.mismatch.compare import Fit
from identify.mismatch.curve import CURVE, rising
from identify.mismatch.data import Evidence
from identify.mismatch.locate import COORDINATE, named_location, reach
from identify.mismatch.nameless import SMALLEST as FELT
from identify.mismatch.nameless import Structure
from identify.mismatch.progress import Doing, Stage, Tell
from identify.mismatch.report_values import reported
from identify.mismatch.result import Quantity
from identify.mismatch.rules import CLEAN, NO_NAME, SMALLEST, STRAY, Step, Z, overwhelming, strong, telling
from identify.mismatch.select import EXACT, Selection
from identify.mismatch.sensor_errors import zero_jumps
from identify.mismatch.structure import structures
from identify.mismatch.uncatalogued import PLACED, acts_in
from identify.mismatch.uncatalogued_memory import FILM, remembers_along
from identify.mismatch.wandering import OTHERS, STEP
from plant.axis import Axis

OUT = 2.0  # times the evidence of whatever else was tried: a tone of little force that is not something else
MORE = 1.25  # times the evidence of what is no finding: physics in no catalogue that has less is that
SOMEWHERE = {"rail_defect", "end_stop", "step_change"}  # act in part of the travel or of the time


@dataclasses.dataclass(frozen=True)
class Remains:
    """Where to look for what no name stands for.

    Attributes:
        axis: what the commissioning engineer knows.
        evidence: data that were fitted, and those that judge.
        selection: the chosen effects, and what else was tried.
        bare: the model without them.
        progress: who is told.
    """

    axis: Axis
    evidence: Evidence
    selection: Selection
    bare: Fit
    progress: Tell

    @cached_property
    def beside_names(self) -> list[Structure]:
        """Structure beside the chosen effects, the most evident first."""
        self.progress(Doing(Stage.CONCLUSION, "what is left"))
        chosen = self.selection.chosen
        steps, rivals = self.selection.steps, self.selection.rivals
        suspicious = not steps and chosen.latent_force > CLEAN * chosen.dry_level
        found = structures(chosen, self.evidence.held_out, suspicious=suspicious)
        found = [s for s in found if self._felt(s)]
        beside = rivals[-1] if steps and len(rivals) > len(steps) else []
        strange = self._strange(beside, lambda step: strong(step) or overwhelming(step.evidence))
        return sorted([*found, *strange], key=lambda one: -one.evidence)

    @cached_property
    def without_names(self) -> list[Structure]:
        """Structure that the model without effects leaves, the most evident first."""
        named, unseen = bool(self.selection.steps), self.evidence.held_out
        left = structures(self.bare, unseen, suspicious=True) if named else self.beside_names
        return sorted([*left, *self._strange(self.selection.opening)], key=lambda one: -one.evidence)

    @property
    def refused_names(self) -> list[Structure]:
        """What the chosen effects would explain, which are no chance but do not stand."""
        return [self._along(step) for step in self.selection.steps if telling(step)]

    @property
    def odd(self) -> list[Structure]:
        """Sensors that jump, or what no effect of that size or sign can be."""
        return zero_jumps(self.evidence.train) or self._misfits

    @property
    def rising(self) -> list[Structure]:
        """A curve over the speed that eq. (1) only imitates."""
        found = rising(self.selection.baseline, reach("velocity", self.evidence.train, self.axis))
        return [] if found is None else [found]

    def strayed(self, astray: float) -> list[Structure]:
        """What was not fitted of a recording, where its error is `astray` times that of a model fitted to it. [1]"""
        if astray <= STRAY:
            return []
        rest = self.evidence.held_out.t
        evidence = len(self.evidence.train) * float(np.log(astray))
        return [Structure("time", (float(rest.min()), float(rest.max())), evidence, Z, 0.0)]

    @property
    def duration(self) -> float:
        """Of the longest recording. [s]"""
        return max(float(part.t.max()) for part in (self.evidence.train, self.evidence.held_out))

    def where(self, step: Step, coordinate: str) -> tuple[float, float]:
        """Between what a step acts on its coordinate."""
        name, samples = step.guise.name, self.evidence.train
        reached = (0.0, 0.0)
        if coordinate != "frequency":
            reached = (0.0, self.duration) if coordinate == "time" else reach(coordinate, samples, self.axis)
        if name not in SOMEWHERE | PLACED:
            return reached
        values = reported(step.fit.problem, step.guise, step.fit.x)
        if name in PLACED:
            constant = float(step.fit.problem.law(step.fit.x[None])[5, 0]) - self.axis.mechanics.weight
            return acts_in(name, {parameter: value for parameter, (value, _) in values.items()}, reached, constant)
        sizes = {parameter: Quantity(value, unit) for parameter, (value, unit) in values.items()}
        begin, end = named_location(name, sizes, 0.0, step.evidence.z, samples, self.axis).interval
        goes_back = name == STEP and step.denied and self.evidence.kind == "time"
        return begin, step.evidence.parts if goes_back else end

    def _felt(self, found: Structure) -> bool:
        """Whether a shape is large enough to be told, or stands out though it is small.

        Beside names, what is small may be how their shapes differ; a small tone may be what anything else would be.
        """
        if found.force <= 0.0 or found.force >= FELT * self.selection.chosen.dry_level:
            return True
        most = max((-step.evidence.bic for step in self.selection.opening), default=0.0)
        return not self.selection.steps and (found.coordinate != "frequency" or found.evidence > OUT * most)

    def _strange(self, steps: Sequence[Step], counts: Callable[[Step], bool] = lambda _: True) -> list[Structure]:
        """What physics that is in no catalogue would explain, if it `counts`, or an effect but for its own curve.

        Another exponent of the Stribeck curve is neither.
        """
        more = [step for step in _findings(steps) if counts(step)]
        likely = [step for step in more if telling(step) and step.guise.name != CURVE]
        return [
            *(self._along(step, step.guise.name) for step in likely if step.refused == NO_NAME),
            *(self._along(step, words.denied(step.guise.name, step.denied)) for step in likely if step.denied),
        ]

    @property
    def _misfits(self) -> list[Structure]:
        """What an effect that may not be named would explain: something else acts along its coordinate.

        A drag that is negative is none, but friction does bend over the speed where unseen data say so; what steps more
        than once is no step, but changes with time, if that is more than friction wanders anyway.
        """

        def may_be(one: Step) -> bool:
            wanders = one.refused is not None and one.refused.startswith(OTHERS)
            least = FELT if wanders else SMALLEST
            return one.acting >= least * one.fit.dry_level and (wanders or one.refused is None or one.misplaced)

        likely = [one for one in _findings(self.selection.opening) if may_be(one) and strong(one)]
        likely = [one for one in likely if one.evidence.z > Z]
        return sorted((self._along(step) for step in likely), key=lambda one: -one.evidence)

    def _along(self, step: Step, like: str = "") -> Structure:
        """What a step explains, as structure along its coordinate, where it acts."""
        told, coordinate = step.evidence, step.guise.depends or COORDINATE.get(step.guise.name, "time")
        also: tuple[str, ...] = ()
        if step.guise.name == FILM.name:
            memory, _ = reported(step.fit.problem, step.guise, step.fit.x)["time_constant"]
            coordinate, *others = remembers_along(memory, self.duration)
            also = tuple(others)
        return Structure(coordinate, self.where(step, coordinate), -told.bic, told.z, 0.0, like, also=also)


def _findings(steps: Sequence[Step]) -> list[Step]:
    """Those that explain clearly more than a mass or a torque constant within what data sheets are off by anyway.

    A shift of the clocks, which is no finding either, comes beside anything.
    """
    small = [step for step in steps if step.small and step.guise.name in EXACT]
    usual = max((-step.evidence.bic for step in small), default=0.0)
    return [step for step in steps if -step.evidence.bic > MORE * usual]
