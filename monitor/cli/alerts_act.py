"""`tribowatch alerts acknowledge|shelve|unshelve|suppress|unsuppress|out-of-service|in-service AXIS KIND`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from monitor.cli.commanding import Order, ordered

AxisName = Annotated[str, typer.Argument(help="Name of the axis.")]
KindName = Annotated[str, typer.Argument(help="Kind of the alarm, like wear.")]

ACTIONS = {
    "acknowledge": "Say that you have seen the alarm of KIND of AXIS and take care of it.",
    "unshelve": "Bring a shelved alarm back before its time.",
    "suppress": "Put an alarm aside until unsuppress, because the situation makes it meaningless (by design).",
    "unsuppress": "Take a suppressed alarm back.",
    "out-of-service": "Take an alarm out of service for maintenance, until in-service.",
    "in-service": "Put an alarm back into service.",
}


def make_command(action: str, explanation: str) -> Callable[..., None]:
    """The command line of one action."""

    def run(order: Order, axis: AxisName, kind: KindName) -> None:
        done = order.give(action, axis, {"kind": kind})
        order.report(done, _words(done))

    run.__doc__ = explanation
    return ordered(run)


@ordered
def shelve_command(
    order: Order,
    axis: AxisName,
    kind: KindName,
    for_time: Annotated[str, typer.Option("--for", help="How long, like 8h, 2d.")],
) -> None:
    """Put the alarm of KIND of AXIS aside for a time; then it shows what is true then."""
    done = order.give("shelve", axis, {"kind": kind, "for": for_time})
    order.report(done, _words(done))


def _words(done: dict[str, Any]) -> str:
    state, until = done["state"].replace("_", " "), f" until {done['until'][:16]}Z" if done["until"] else ""
    changed = "" if done["changed"] else " (nothing changed)"
    return f"{done['axis']} {done['kind']}: {state}{until}{changed}"
