"""The screenshot of the README: the axis view of a demo that ran until its alert. `make picture`."""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.contracts.command import ROOT
from tests.page.browsing import CHROMIUM, chromium, window
from tests.page.conftest import Served

FILE = ROOT / "docs" / "images" / "axis.png"
SIZE = {"width": 1300, "height": 1110}
MOST = 200_000  # bytes


def main() -> None:
    """Run the demo, open its axis, take the picture."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--demo", type=Path, help="folder of a demo that has run; else one is run")
    asked = options.parse_args()
    if CHROMIUM is None:
        sys.exit("needs Chromium")
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.demo or Path(scratch) / "demo"
        if asked.demo is None:
            command = [sys.executable, "-m", "monitor", "demo", "--until-alert", "--json", "--state-dir", str(folder)]
            quiet = os.environ | {"TRIBOWATCH_PAGE__LISTEN": "127.0.0.1:0"}
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=quiet, cwd=ROOT)
        take(folder)


def take(folder: Path) -> None:
    """Screenshot of the first axis of the history in `folder`."""
    served = Served(folder, site="demo")
    try:
        axis = served.get("/api/v1/fleet").json()["axes"][0]["axis"]
        with chromium() as browser, window(browser, served.url, size=SIZE) as one:
            one.open(f"/axes/{axis}").with_charts(2)
            one.wait_for_text("#live", "live")
            FILE.parent.mkdir(exist_ok=True)
            one.page.screenshot(path=FILE)
    finally:
        served.close()
    assert FILE.stat().st_size < MOST, f"{FILE} has {FILE.stat().st_size} bytes"


if __name__ == "__main__":
    main()
