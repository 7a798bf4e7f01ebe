"""Ten million rows of history: how long the questions take that people ask, and how large the database is.

`python -m tests.benchmarks.bench_history [--axes 20] [--answers 100000] [--parameters 5]`; rows of the trend
are axes x answers x parameters. Real answers carry their JSON too (about 3 kB each), which no question below reads but
that for the latest one; `--padding 3000` puts as much into every estimate.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from sqlalchemy import insert, text

from monitor.models import AxisRow
from monitor.queries import Reader
from monitor.store import Store
from monitor.store_roll_ups import rebuild_roll_ups

START_NS = 1_700_000_000 * 10**9
DAYS = 116  # of the oldest answer; 100 000 answers are then one every 100 s
DAY_NS = 86_400 * 10**9
NAMES = (
    "coulomb_force", "static_force", "stribeck_velocity", "viscous_coefficient", "constant_force", "moving_mass",
    "friction_at_low_speed", "friction_at_mid_speed", "friction_at_high_speed", "coulomb_level", "viscous_slope",
)  # fmt: skip
COLUMNS = {
    "window": "id, axis_id, epoch, first_seq, samples, start_ns, end_ns, done",
    "estimate": "window_id, axis_id, start_ns, end_ns, verdict, method, evaluations, seed, software, data_sha256, "
    "seconds, result, conditions, drift, criterion, held_out_criterion",
    "parameter": "window_id, name, axis_id, end_ns, value, low, high, unit, identifiable, at_bound",
}
PART = 5_000
LONG = 20 * 10**9  # ns of a window


def fill(store, axes, answers, parameters, padding):
    """Write the history in bulk, as the daemon would have left it."""
    values = {name: {"value": 1.0, "unit": "N"} for name in NAMES[:parameters]}
    result = json.dumps({"parameters": values, "padding": "x" * padding})
    rng = np.random.default_rng(0)
    step = DAYS * DAY_NS // answers
    for axis in range(1, axes + 1):
        with store._write() as db:
            counts = {"identified": answers}
            last = START_NS + answers * step
            head = {"id": axis, "name": f"axis-{axis:04d}", "listed": True, "verdicts": counts, "last_ns": last}
            db.execute(insert(AxisRow), [{**head, "rejected": {}, "samples": 500 * answers, "missing": 0}])
            for first in range(0, answers, PART):
                numbers = range(first, min(first + PART, answers))
                rows = [(axis - 1) * answers + k + 1 for k in numbers]
                ends = [START_NS + (k + 1) * step for k in numbers]
                put(
                    db,
                    "window",
                    [(row, axis, 1, 500 * row, 2000, end - LONG, end, 1) for row, end in zip(rows, ends, strict=True)],
                )
                answer = ("ga+polish", 400, 0, "0", "0" * 64, 0.1, result, "{}", "[]", 1e-5, 1e-5)
                put(
                    db,
                    "estimate",
                    [(row, axis, end - LONG, end, "identified", *answer) for row, end in zip(rows, ends, strict=True)],
                )
                for name in NAMES[:parameters]:
                    values = (90 + rng.standard_normal(len(rows))).tolist()
                    known = zip(rows, ends, values, strict=True)
                    put(db, "parameter", [(row, name, axis, end, x, x - 2, x + 2, "N", 1, 0) for row, end, x in known])
            rebuild_roll_ups(db, axis, START_NS, last)
        sys.stderr.write(f"\raxis {axis} of {axes}")
    sys.stderr.write("\n")


def put(db, table, rows):
    """Many rows by the driver itself."""
    marks = ", ".join("?" * len(rows[0]))
    db.exec_driver_sql(f'insert into "{table}" ({COLUMNS[table]}) values ({marks})', rows)


def timed(question, times=7):
    """Median and longest of several runs, and the processor time of the median one. [ms]"""
    taken = []
    for _ in range(times):
        begun, busy = time.perf_counter(), time.process_time()
        answer = question()
        taken.append((1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - busy)))
    wall, processor = (statistics.median(one) for one in zip(*taken, strict=True))
    longest = max(taken)[0]
    return {"ms": round(wall, 1), "cpu_ms": round(processor, 1), "longest_ms": round(longest, 1), "points": answer}


def points_of(reader, **asked):
    series = reader.history("axis-0001", **asked)["series"]
    return sum(len(one["points"]) for one in series.values())


def run(path, axes, answers, parameters, padding):
    url = f"sqlite:///{path}"
    store = Store(url)
    begun = time.perf_counter()
    fill(store, axes, answers, parameters, padding)
    report = {"rows": axes * answers * parameters, "axes": axes, "answers": axes * answers,
              "fill_seconds": round(time.perf_counter() - begun)}  # fmt: skip
    with store._engine.connect() as db:
        report["roll_up_rows"] = db.execute(text("select count(*) from roll_up")).scalar_one()
    store.close()
    report["database_bytes"] = path.stat().st_size
    report["bytes_per_row"] = round(report["database_bytes"] / report["rows"], 1)
    one = {"parameter": "coulomb_force"}
    day = DAY_NS
    with Reader(url) as reader:
        report["queries"] = {
            "one day, one parameter": timed(lambda: points_of(reader, since_ns=day, **one)),
            "30 days to 500 points, one parameter": timed(lambda: points_of(reader, since_ns=30 * day, **one)),
            "whole life to 500 points, one parameter": timed(lambda: points_of(reader, **one)),
            "30 days to 500 points, all parameters": timed(lambda: points_of(reader, since_ns=30 * day)),
            "whole life to 500 points, all parameters": timed(lambda: points_of(reader)),
            "latest of all axes (tribowatch axes)": timed(lambda: len(reader.axes())),
        }
    return report


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("--axes", type=int, default=20)
    parse.add_argument("--answers", type=int, default=100_000)
    parse.add_argument("--parameters", type=int, default=5)
    parse.add_argument("--padding", type=int, default=0, help="bytes of JSON besides, in every estimate")
    given = parse.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "history.db"
        report = run(path, given.axes, given.answers, given.parameters, given.padding)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
