"""Where this process may leave files: caches and error details stay inside a checkout or a cache folder."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def cache_dir() -> Path:
    """First folder we can write to: `.cache` of the checkout, the user's cache, the temporary folder."""
    candidates = []
    if (ROOT / "pyproject.toml").is_file():
        candidates.append(ROOT / ".cache")
    if "XDG_CACHE_HOME" in os.environ or os.environ.get("HOME"):
        base = os.environ.get("XDG_CACHE_HOME") or Path(os.environ["HOME"]) / ".cache"
        candidates.append(Path(base) / "tribowatch")
    for candidate in candidates:
        if _writable(candidate):
            return candidate
    return Path(tempfile.gettempdir()) / f"tribowatch-{os.getuid()}"


def prepare_environment() -> None:
    """Name the folder of the compiled kernels before numba is imported; children inherit it.

    Without it numba refuses to import where the code is read-only and there is no home.
    """
    os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_dir() / "numba"))


def _writable(folder: Path) -> bool:
    """Make `folder` if need be and say whether files can be put there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)
