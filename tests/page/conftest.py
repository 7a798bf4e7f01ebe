"""A page on a history of its own, served by the real server on a free port."""

import time
from pathlib import Path

import httpx
import pytest

from monitor.board import Board
from monitor.commands import CommandBox
from monitor.config import Config
from monitor.http_server import serve_page
from tests.page.histories import SITE, write_history


@pytest.fixture(scope="session")
def history(tmp_path_factory):
    """State directory with a healthy axis, a worn one, and one that never sent anything. Read only, please."""
    folder = tmp_path_factory.mktemp("page")
    write_history(folder / "tribowatch.db")
    return folder


class Served:
    """A page with what stands behind it."""

    def __init__(self, folder: Path, site=SITE, **page) -> None:
        settings = {"listen": "127.0.0.1:0", **page}
        self.config = Config(site=site, state_dir=folder, page=settings)
        self.board, self.box = Board(time.monotonic), CommandBox()
        self.server = serve_page(self.config, self.board, self.box)
        self.url = self.server.url.rstrip("/")
        self.client = httpx.Client(base_url=self.url, timeout=30)

    def get(self, path, **more):
        return self.client.get(path, **more)

    def close(self):
        self.client.close()
        self.server.close()


@pytest.fixture(scope="module")
def served(history):
    page = Served(history)
    yield page
    page.close()


@pytest.fixture
def serve(history):
    """Serve the history with other settings."""
    pages = []

    def start(**page):
        pages.append(Served(history, **page))
        return pages[-1]

    yield start
    for one in pages:
        one.close()
