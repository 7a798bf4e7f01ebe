"""Where compiled code is kept, so that the first-start cost is paid once.

numba looks only at the file of the function it loads: change a function that is inlined elsewhere and stale machine
code comes back. The folder therefore carries a digest of all kernel sources of this package.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numba

PLANT = Path(__file__).resolve().parent.parent
FROM_ENVIRONMENT = "NUMBA_CACHE_DIR"


def sources_digest() -> str:
    """Twelve hexadecimal digits that change when any kernel or effect of this package changes."""
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted([*PLANT.glob("kernels/*.py"), *PLANT.glob("effects/*.py")]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def cache_folder() -> Path:
    """The first writable: `NUMBA_CACHE_DIR`, the code's own folder, the user's cache, a temporary one (warns)."""
    given = os.environ.get(FROM_ENVIRONMENT)
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    wanted = [Path(given)] if given else []
    wanted += [PLANT / "kernels" / "__pycache__", Path(home) / "tribowatch"]
    for base in wanted:
        folder = base / f"kernels-{sources_digest()}"
        if _writable(folder):
            return folder
    tried = " nor ".join(str(base) for base in wanted)
    warnings.warn(
        f"cannot write compiled code to {tried}: it is compiled anew at each start (half a minute); "
        f"set {FROM_ENVIRONMENT} to a folder that can be written",
        RuntimeWarning,
        stacklevel=2,
    )
    return Path(tempfile.mkdtemp(prefix="tribowatch-kernels-"))


def use_cache_folder() -> Path:
    """Tell numba; before the first kernel is imported."""
    folder = cache_folder()
    config: Any = numba.config
    config.CACHE_DIR = str(folder)
    return folder


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
