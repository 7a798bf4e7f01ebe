"""First paint and data size of each view: `make page-figures`. A year of history: 20 axes every three hours, 1000 axes
every three days.

One axis is judged window by window by the real watch; the others are copies of its rows, which a page cannot tell.
Prints the table of docs/page.md. Times are of this computer: compare within one run only.
"""

import argparse
import json
import sqlite3
import sys
import tempfile
import time
from pathlib import Path

from monitor.store import Store
from tests.page.browsing import CHROMIUM, chromium, window
from tests.page.conftest import Served
from tests.page.histories import named, wearing, write_axis_history, write_diagnosis

DAY_NS = 86_400 * 10**9
COPIED = ("gap", "alarm", "transition", "roll_up")  # tables with an axis_id and nothing that points at them
VIEWS = {
    "/": 0, "/axes/axis-0000": 2, "/alerts": 0, "/alerts/axis-0000/wear": 1, "/diagnoses/axis-0000/1": 3,
    "/system": 0,
}  # fmt: skip
PAINTS = """() => JSON.stringify(Object.fromEntries(
  performance.getEntriesByType('paint').map((p) => [p.name, p.startTime])))"""
SIZES = """() => performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation')).map(
  (r) => ({ name: r.name, sent: r.transferSize, plain: r.decodedBodySize }))"""


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--axes", type=int, nargs="*", default=[20, 1000])
    options.add_argument("--windows", type=int, nargs="*", default=[2920, 122])
    asked = options.parse_args()
    if CHROMIUM is None:
        sys.exit("needs Chromium")
    rows = []
    with chromium() as browser:
        for axes, windows in zip(asked.axes, asked.windows, strict=True):
            with tempfile.TemporaryDirectory() as folder:
                size = write(Path(folder), axes, windows)
                rows += measure(browser, Path(folder), axes, windows)
                say(f"{axes} axes x {windows} windows: history of {size / 1e6:.0f} MB")
    print("| axes x windows | view | shell kB | data kB | first paint ms | numbers ms | charts ms |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |")


def write(folder: Path, axes: int, windows: int) -> int:
    """A history of `axes` axes over a year; gives its size. [B]"""
    path = folder / "tribowatch.db"
    store = Store(f"sqlite:///{path}")
    late = windows - 60
    write_axis_history(
        store, named("axis-0000"), windows, lambda k: wearing(k - late + 40), every_ns=365 * DAY_NS // windows
    )
    write_diagnosis(store, named("axis-0000"))
    store.register([named(f"axis-{k:04}") for k in range(axes)])
    store.close()
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA synchronous=OFF")
        for number in range(1, axes):
            copy(db, number)
    db.close()
    return path.stat().st_size


def copy(db, number):
    """Give axis `number` the rows of the first one."""
    [[own]] = db.execute("SELECT id FROM axis WHERE name = ?", (f"axis-{number:04}",))
    keep = ("samples", "missing", "last_ns", "drift", "rejected", "stream")
    db.execute(
        f"UPDATE axis SET ({','.join(keep)}) = (SELECT {','.join(keep)} FROM axis WHERE id = 1) WHERE id = ?", (own,)
    )
    step = number * 10_000_000
    for table in ("window", "estimate", "parameter"):
        names = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
        key = "id" if table == "window" else "window_id"
        values = [str(own) if n == "axis_id" else f"{key} + {step}" if n == key else n for n in names]
        db.execute(f"INSERT INTO {table} ({','.join(names)}) SELECT {','.join(values)} FROM {table} WHERE axis_id = 1")
    for table in COPIED if number % 50 == 0 else COPIED[-1:]:
        names = [row[1] for row in db.execute(f"PRAGMA table_info({table})") if row[1] != "id"]
        values = [str(own) if n == "axis_id" else n for n in names]
        db.execute(f"INSERT INTO {table} ({','.join(names)}) SELECT {','.join(values)} FROM {table} WHERE axis_id = 1")


def measure(browser, folder: Path, axes: int, windows: int):
    """One row per view."""
    served = Served(folder, requests_per_minute=100_000)
    try:
        with window(browser, served.url) as one:
            one.open("/axes/axis-0000").with_charts(2)  # the browser has plotly, the server its connections
        for path, charts in VIEWS.items():
            with window(browser, served.url) as one:
                begun = time.monotonic()
                one.page.goto(served.url + path, wait_until="commit")
                one.page.wait_for_selector("main[data-drawn=yes]")
                numbers = time.monotonic() - begun
                one.with_charts(charts)
                drawn = f"{1000 * (time.monotonic() - begun):.0f}" if charts else "–"
                paint = json.loads(one.page.evaluate(PAINTS))
                parts = one.page.evaluate(SIZES)
                data = sum(part["sent"] for part in parts if "/api/" in part["name"] and "events" not in part["name"])
                shell = sum(
                    part["sent"] for part in parts if "/api/" not in part["name"] and "plotly" not in part["name"]
                )
                first = f"{paint.get('first-contentful-paint', float('nan')):.0f}"
                yield (
                    f"{axes} x {windows}",
                    path,
                    f"{shell / 1e3:.0f}",
                    f"{data / 1e3:.0f}",
                    first,
                    f"{1000 * numbers:.0f}",
                    drawn,
                )
    finally:
        served.close()


def say(text: str) -> None:
    """Progress, on stderr."""
    print(text, file=sys.stderr)


if __name__ == "__main__":
    main()
