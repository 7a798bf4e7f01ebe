"""`python -m monitor.warm`: compile the kernels into the cache, so that nothing waits later."""

from __future__ import annotations

import sys
import time

from monitor.cli.environment import prepare_environment


def warm() -> float:
    """Simulate one burst of a machine and identify its friction, as the daemon will; gives the seconds it took."""
    started = time.perf_counter()
    from identify.identification import identify_friction
    from identify.mismatch.uncatalogued import EFFECTS
    from plant.scenario_file import read_scenario
    from plant.warm import warm_up

    warm_up((effect.name, lambda effect=effect: [law.address for law in effect.laws]) for effect in EFFECTS)  # type: ignore[misc]
    machine = read_scenario("wear")
    identify_friction(machine.burst(0).recording, machine.axis)
    return time.perf_counter() - started


if __name__ == "__main__":
    prepare_environment()
    sys.stderr.write(f"kernels ready in {warm():.1f} s\n")
