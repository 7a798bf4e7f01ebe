"""Compare the pinned packages with the index of known advisories: `make advisories`.

Uses pip-audit, which calls packages that its index does not know "no known vulnerabilities"; here that is said. Exit
code 0 where nothing is known against any pin, or where no index could be asked (one line says why), 1 otherwise.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

SECONDS = 300.0  # s for all pins
PROBE = "starlette==0.27.0"  # has an advisory, so that silence of the index shows
NOT_AUDITED = "advisories: not audited"


def ask(pins: list[str], folder: Path) -> dict[str, Any]:
    """What pip-audit says about `pins`; an `error` in place of it where it cannot ask. Writes a file in `folder`."""
    listed = folder / "pins.txt"
    listed.write_text("\n".join(pins) + "\n")
    words = [sys.executable, "-m", "pip_audit", "--requirement", str(listed), "--no-deps", "--disable-pip"]
    words += ["--progress-spinner", "off", "--format", "json"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=SECONDS, check=False)
        answer: dict[str, Any] = json.loads(done.stdout)
    except subprocess.TimeoutExpired:
        return {"error": f"no answer within {SECONDS:g} s"}
    except ValueError:
        return {"error": (done.stderr.strip().splitlines() or ["no answer"])[-1][:200]}
    return answer


def is_alive(probed: dict[str, Any]) -> bool:
    """Whether the index knows the advisory that it must know."""
    return any(one.get("vulns") for one in probed.get("dependencies", []))


def judge(report: dict[str, Any]) -> tuple[int, list[str]]:
    """Exit code and lines for what was said about the pins."""
    if "error" in report:
        return 0, [f"{NOT_AUDITED}: {report['error']}"]
    packages = report["dependencies"]
    known = [
        f"{one['name']} {one['version']}: {advice['id']}, mended in {', '.join(advice['fix_versions']) or 'no version'}"
        for one in packages
        for advice in one.get("vulns", [])
    ]
    unknown = [one["name"] for one in packages if "skip_reason" in one]
    told = [f"advisories: the index does not know {', '.join(unknown)}"] if unknown else []
    asked = len(packages) - len(unknown)
    return (1, [*known, *told]) if known else (0, [*told, f"advisories: none is known against {asked} pinned packages"])


def main() -> int:
    """Audit the pins in the file named first, with the folder named second for scratch."""
    pins = [line for line in Path(sys.argv[1]).read_text().splitlines() if line and not line.startswith("#")]
    folder = Path(sys.argv[2])
    probed = ask([PROBE], folder)
    if is_alive(probed):
        code, lines = judge(ask(pins, folder))
    else:
        code, lines = 0, [f"{NOT_AUDITED}: {probed.get('error', 'no index of advisories can be reached from here')}"]
    sys.stdout.write("\n".join(lines) + "\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
