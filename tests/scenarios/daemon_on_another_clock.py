"""The daemon on a wall clock that a test sets: `python -m tests.scenarios.daemon_on_another_clock run --config FILE`.

The file `clock` beside the configuration says by how much the clock is wrong. [s]
"""

import sys
import time
from pathlib import Path

_true, _true_ns = time.time, time.time_ns
_file = Path(sys.argv[sys.argv.index("--config") + 1]).parent / "clock"


def _error() -> float:
    return float(_file.read_text() or 0.0) if _file.exists() else 0.0


if __name__ == "__main__":
    time.time = lambda: _true() + _error()
    time.time_ns = lambda: _true_ns() + round(1e9 * _error())
    from monitor.cli import main  # only now: the pipeline takes its clock when it is imported

    main()
