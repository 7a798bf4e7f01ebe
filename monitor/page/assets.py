"""The page's own files and plotly's script, ready to be sent: packed once, named by content. Reads package files."""

from __future__ import annotations

import functools
import gzip
import hashlib
import re
from dataclasses import dataclass
from importlib import resources

TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
}
PLOTLY = "plotly.min.js"


@dataclass(frozen=True, slots=True)
class Asset:
    """A file as it is sent."""

    kind: str
    plain: bytes
    packed: bytes


@functools.cache
def own_files() -> dict[str, bytes]:
    """The hand-written files by name."""
    folder = resources.files("monitor.page").joinpath("files")
    return {one.name: one.read_bytes() for one in sorted(folder.iterdir(), key=lambda one: one.name)}


@functools.cache
def version() -> str:
    """Changes when any of our files does, so that browsers may keep them for good."""
    return hashlib.sha256(b"\0".join(own_files().values())).hexdigest()[:12]


@functools.cache
def plotly() -> tuple[str, bytes]:
    """Version and text of plotly's script, as the plotly package carries it."""
    from importlib.metadata import version as installed

    from plotly.offline import get_plotlyjs

    return installed("plotly"), get_plotlyjs().encode()


@functools.cache
def guards() -> tuple[str, ...]:
    """Ids of elements whose presence keeps plotly from adding style elements, which our policy refuses.

    Its map library adds its style sheet unless an element of that id is there; we draw no maps.
    """
    found = re.findall(rb'if\(!document\.getElementById\("([0-9a-f]{64})"\)\)', plotly()[1])
    return tuple(one.decode() for one in found)


@functools.cache
def asset(folder: str, name: str) -> Asset | None:
    """A file by the address the shell gave; None where there is none."""
    if name == PLOTLY:
        number, text = plotly()
        return _packed(name, text) if folder == number else None
    if folder != version() or name not in own_files():
        return None
    return _packed(name, own_files()[name])


def _packed(name: str, content: bytes) -> Asset:
    kind = TYPES.get(name[name.rfind(".") :], "application/octet-stream")
    return Asset(kind, content, gzip.compress(content, 6, mtime=0))


def address(name: str) -> str:
    """Where the browser finds a file."""
    return f"/static/{plotly()[0] if name == PLOTLY else version()}/{name}"
