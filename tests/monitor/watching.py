"""What the watch says of a row of estimates, for tests of it."""

from monitor.drift import DriftState, judge


def watch(rule, estimates, state=None):
    """State and the kinds that hold after each estimate."""
    state, held = state or DriftState(), []
    for one in estimates:
        state, findings = judge(state, one, rule)
        held.append({finding.kind for finding in findings if finding.holds})
    return state, held


def raised(held):
    """How often something was raised."""
    return sum(bool(now) and not before for before, now in zip([set(), *held[:-1]], held, strict=True))


def delay_of(held):
    """Windows until the first finding, the first changed one counted."""
    return next((n for n, now in enumerate(held, start=1) if now), len(held) + 1)
