"""Who looks on: the board of what the daemon says, the page that shows it, and the file that says where it is."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import structlog

from monitor.board import Board
from monitor.commands import CommandBox
from monitor.config import Config
from monitor.config_page import ADDRESS_FILE
from monitor.http_server import serve_page

log = structlog.get_logger()

Publish = Callable[[str, str, dict[str, Any]], None]


class Audience:
    """Hears everything that is published, and each turn of the supervising thread."""

    def __init__(self, board: Board, ears: tuple[Publish, ...]) -> None:
        """Pass what is said to `board` and `ears`."""
        self.board, self._ears = board, (board.hear, *ears)

    def beside(self, publish: Publish) -> Publish:
        """`publish`, which we hear too."""
        ears = (publish, *self._ears)

        def tell(what: str, axis: str, content: dict[str, Any]) -> None:
            for ear in ears:
                ear(what, axis, content)

        return tell


@contextlib.contextmanager
def audience(config: Config, commands: CommandBox) -> Iterator[Audience]:
    """The page, where the configuration wants one, for as long as the daemon runs.

    Raises:
        ConfigError: it cannot be served as configured.
        PageError: it cannot listen.
    """
    board = Board(time.monotonic)
    with contextlib.ExitStack() as stack:
        page = serve_page(config, board, commands)
        if page is None:
            log.info("no page: [page] listen is empty")
            yield Audience(board, ())
            return
        stack.callback(page.close)
        stack.enter_context(_announced(config.state_dir / ADDRESS_FILE, page.url))
        log.info("page", address=page.url)
        yield Audience(board, (page.hear,))


@contextlib.contextmanager
def _announced(path: Path, address: str) -> Iterator[None]:
    """Keep the page's address at `path` while it is served, for programs on this computer."""
    with contextlib.suppress(OSError):
        path.write_text(address + "\n", encoding="utf-8")
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink()
