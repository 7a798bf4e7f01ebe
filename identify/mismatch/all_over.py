"""Names found in tenths from all over the recordings, judged by the tenths between.

What is held out at an end, or in another recording, may know nothing of an effect: the drift was over by then, the dent
was passed twice. Or it has what was never fitted: another speed, a load, a mood of friction. Tenths from all over have
seen, and are judged by, all that there was. They cannot tell an effect of the machine from what one recording alone
has: that is what the end, or the other recording, is asked for then.
"""

from __future__ import annotations

from identify.mismatch.carried import starts_from
from identify.mismatch.compare import compare, fit
from identify.mismatch.conclusion import Conclusion
from identify.mismatch.result import Verdict
from identify.mismatch.rules import BIC, CLEAN, SAME
from identify.mismatch.select import without
from identify.mismatch.wandering import STEP

QUARTER_LEFT = 0.25  # of the one-second error on unseen data: where less is left, and little force, names are complete


def may_lack(first: Conclusion) -> bool:
    """Whether tenths may tell more than `first`: it knows nothing, or leaves error or force for another name.

    What it recognised as physics in no catalogue is known, unless that only happened in time, as two effects may.
    """
    if first.verdict is not Verdict.EXPLAINED:
        return first.happened or not first.recognised
    if not first.selection.steps:
        return True
    left = first.selection.chosen
    return first.error_left > QUARTER_LEFT or left.latent_force > CLEAN * left.dry_level


def tells_more(tenths: Conclusion, first: Conclusion) -> bool:
    """Whether names found all over are the answer: `first` told none, or fewer, and its unseen data deny none.

    Physics in no catalogue that is likelier there, or has the curve of an effect, is no effect all over either; and a
    step alone may be a mood of friction, which lasts from one tenth to the next.
    """
    if tenths.verdict is not Verdict.EXPLAINED or first.denies(tenths.said) or first.outdoes(tenths):
        return False
    names, known = tenths.told, first.told
    one_force = len(names) > len(known) and known <= SAME and bool(names & SAME)
    return (known < names or one_force) and names - known != {STEP} and _undenied(tenths, first)


def _undenied(tenths: Conclusion, first: Conclusion) -> bool:
    """Whether what `first` held out is no less likely with each of the names, fitted to what `first` fitted.

    A place that was harder in one of two recordings (beside a torque constant) had 2316 and 1052 in tenths of both, and
    -1135 and -1319 from one to the other; of 25 true names none had less than -1.
    """
    baseline = first.selection.baseline
    problem = baseline.problem.including(tenths.final.problem.guises)
    whole, alone = fit(problem, starts_from(problem, baseline, tenths.final)), len(problem.guises) == 1
    rests = (baseline if alone else without(whole, step.guise) for step in tenths.selection.steps)
    return all(compare(rest, whole, first.evidence.held_out).foreseen > BIC for rest in rests)
