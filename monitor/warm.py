"""`python -m monitor.warm`: compile the kernels into the cache, so that nothing waits later."""

from __future__ import annotations

import sys
import time

from monitor.cli.environment import prepare_environment


def warm() -> float:
    """Run each compiled kernel once on a few samples; gives the seconds it took."""
    started = time.perf_counter()
    import numpy as np

    from plant.kernels.population import march

    samples, candidates = 8, 4
    law = np.full((6, candidates), 0.5)
    march(
        np.zeros(samples),
        np.full(samples - 1, 0.01),
        2,
        False,
        law,
        np.zeros(candidates),
        np.zeros(candidates),
        np.empty((samples, candidates)),
    )
    return time.perf_counter() - started


if __name__ == "__main__":
    prepare_environment()
    sys.stderr.write(f"kernels ready in {warm():.1f} s\n")
